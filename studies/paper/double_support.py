"""Fig. 6.1: friction only in the right knee, five steps in the ideal simulator, exact accelerations.

On one foot (5.13) gives every joint's friction exactly. On two feet M_mod^-1 is singular, and (6.1) picks one of the
many frictions that explain the same accelerations. The choice depends on the weights, which are varied here. In the
paper's simulator feet keep their orientation after landing. In our simulator they rotate until they are level within
0.3 s, and are therefore not quite at rest.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stribeck import Robot, Settings
from stribeck.core.base.typing import Array
from stribeck.core.dynamics.contact.mode import ContactMode
from stribeck.core.dynamics.state import Orientation, State
from stribeck.paper.figures.double_support import ambiguous_friction, weighted_friction
from stribeck.simulation.run import Simulated
from studies.changes import known
from studies.markdown import percent
from studies.paper.estimate import EXACT, Estimate, estimate, rms
from studies.paper.study import Numbers
from studies.paper.walks import get_walk

WALKS = ("right-knee-literal", "right-knee-ideal")
KNEE = "right_knee"
BOTH = "left_foot+right_foot"
STRIDE = 20
"""Stride between the double-support samples that are solved with every weighting."""


def run(quick: bool) -> Numbers:
    walks = {name: get_walk(name, quick) for name in WALKS}
    found = {name: _estimate(walk) for name, walk in walks.items()}
    return {
        "phases": {name: _by_phase(each) for name, each in found.items()},
        "weightings": {name: _vary_weights(walk) for name, walk in walks.items()},
    }


def _estimate(walk: Simulated) -> Estimate:
    """Estimate the friction torque of all samples; in double support, (6.1) gives the joints of standing legs."""
    found = estimate(walk, Settings(filter=EXACT, standing_legs=True))
    both, robot, log = np.flatnonzero(found.standing_on(BOTH)), walk.robot, walk.log
    rows = np.searchsorted(log.time, found.samples.time[both] - found.samples.period / 2)
    mode = ContactMode(robot, log.foot_names)
    guess = weighted_friction(*ambiguous_friction(mode, _state(walk, rows), log.torque[rows]))
    standing = mode.standing[robot.torque_controlled]
    friction = found.samples.friction_torque
    friction[np.ix_(both, standing)] = guess[:, standing]
    return replace(found, samples=replace(found.samples, friction_torque=friction))


def _by_phase(found: Estimate) -> dict[str, dict[str, float]]:
    """Compute the error of the estimate in single and in double support [N m]."""
    both, knee = found.standing_on(BOTH), found.column(KNEE)
    return {
        phase: {
            "samples": int(np.sum(rows)),
            "knee_friction_rms": rms(found.truth[rows, knee]),
            **_errors(found.error[rows], knee),
            "largest_error": float(np.nanmax(np.abs(found.error[rows]))),
        }
        for phase, rows in {"one foot": ~both, "two feet": both}.items()
    }


def _errors(error: Array, knee: int) -> dict[str, float]:
    """Compute the RMS errors of the knee and of all other joints [N m]."""
    return {"knee_error_rms": rms(error[:, knee]), "other_error_rms": rms(np.delete(error, knee, axis=1))}


def _weightings(robot: Robot) -> dict[str, dict[str, float | Array]]:
    """Choose W and lambda of (6.1), by the meaning of the weighting."""
    joints = np.array(robot.joint_names)[robot.torque_controlled]
    left, right = np.char.startswith(joints, "left"), np.char.startswith(joints, "right")
    knees = np.char.endswith(joints, "knee")
    return {
        "W = 1, λ = 1e-8": {},
        "W of the right side 100 times larger": {"weight": np.where(right, 100.0, 1.0)},
        "λ of the left side 100 times larger": {"penalty": np.where(left, 1e-6, 1e-8)},
        "λ of the knees 10,000 times smaller": {"penalty": np.where(knees, 1e-12, 1e-8)},
        "λ of the right knee 10,000 times smaller": {"penalty": np.where(knees & right, 1e-12, 1e-8)},
        "λ = 1e-2": {"penalty": 1e-2},
        "λ = 1": {"penalty": 1.0},
    }


def _vary_weights(walk: Simulated) -> dict[str, dict[str, float]]:
    """Compute the error of (6.1) in double support, by its weights."""
    log, robot = walk.log, walk.robot
    rows = np.flatnonzero(known(log.contact).all(axis=1))[::STRIDE]
    mobility, friction = ambiguous_friction(ContactMode(robot, log.foot_names), _state(walk, rows), log.torque[rows])
    knee, joints = robot.joint_names.index(KNEE), robot.torque_controlled
    knee, truth = joints.tolist().index(knee), walk.truth.friction_torque[rows][:, joints]
    return {
        label: _errors(weighted_friction(mobility, friction, **weights) - truth, knee)
        for label, weights in _weightings(robot).items()
    }


def _state(walk: Simulated, rows: NDArray[np.int64]) -> State:
    """Select the exact motion at some rows of the log."""
    log, truth = walk.log, walk.truth
    rates, changes = known(truth.base_velocity)[rows, 3:], known(truth.base_acceleration)[rows, 3:]
    turn = Orientation(known(log.base_orientation)[rows], rates, changes)
    return State(log.position[rows], known(log.velocity)[rows], known(log.acceleration)[rows], turn)


def texts(numbers: Numbers) -> dict[str, str]:
    """Format the errors by phase and by weighting."""
    literal = numbers["weightings"][WALKS[0]]
    (one, two), (one_levelled, two_levelled) = (numbers["phases"][walk].values() for walk in WALKS)
    return {
        "single": f"{one['knee_error_rms']:.1g} N m",
        "single-levelled": f"{one_levelled['knee_error_rms']:.1g} N m",
        "double": f"{two['knee_error_rms']:.2g} N m",
        "double-share": percent(two["knee_error_rms"] / two["knee_friction_rms"]),
        "double-levelled": f"{two_levelled['knee_error_rms']:.1f} N m",
        "known": f"{literal['λ of the right knee 10,000 times smaller']['knee_error_rms']:.1g} N m",
    }
