"""Logs with a known cause of misfit, for the study of what is told: two humanoids' walks, and an arm's motion.

Causes are those of `studies.harder_cases`, friction that no law of velocity describes, and sensors that err in some
joints alone. Friction that is added is worked out along the motion that was walked: motors take what it needs more.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pinocchio as pin

from stribeck import Robot
from stribeck.friction import get_law
from stribeck.log import RobotLog
from stribeck.typing import Array
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.robots.biped import MODELS
from stribeck_simulation.run import Simulated
from stribeck_simulation.sensors.measure import with_noise
from studies.accuracy_cases import CASES as USUAL
from studies.accuracy_cases import Case
from studies.harder_cases import CONDITIONS, as_seen, other_walks

STEEP = 40.0
"""Slope of the smooth sign in friction that is added [s/rad]."""

Change = Callable[[RobotLog, Array, Array], Array]
"""What a cause adds to the torque of a log, given each joint's Coulomb friction and load [N m], shape (T, n).

A joint without the cause is given none.
"""


def _velocity(log: RobotLog) -> Array:
    return np.asarray(np.gradient(log.position, log.time, axis=0))


def load(log: RobotLog, coulomb: Array, carried: Array) -> Array:
    """Return a tenth of the load, against the motion."""
    return np.asarray(0.1 * np.abs(carried) * np.tanh(STEEP * _velocity(log)) * (coulomb > 0))


def drift(log: RobotLog, coulomb: Array, _: Array) -> Array:
    """Return what is missing if Coulomb friction loses 40 % in the course of the log."""
    run = (log.time - log.time[0]) / (log.time[-1] - log.time[0])
    return np.asarray(-0.4 * run[:, None] * coulomb * np.tanh(STEEP * _velocity(log)))


def presliding(log: RobotLog, coulomb: Array, _: Array) -> Array:
    """Return what is missing if Coulomb friction follows within 6 mrad of travel."""
    sign = np.tanh(STEEP * _velocity(log))
    kept = np.exp(-np.abs(np.diff(log.position, axis=0, prepend=log.position[:1])) / 0.006)
    z = np.zeros_like(sign)
    for k in range(1, len(z)):
        z[k] = sign[k] + (z[k - 1] - sign[k]) * kept[k]
    return np.asarray(coulomb * (z - sign))


def play(log: RobotLog, coulomb: Array, carried: Array) -> Array:
    """Return what is missing where the link's torque does not get through for 20 ms after it has changed its sign."""
    changed = np.diff(np.sign(carried), axis=0, prepend=np.sign(carried[:1])) != 0
    span = round(0.02 / float(np.median(np.diff(log.time))))
    crossing = np.apply_along_axis(np.convolve, 0, changed.astype(float), np.ones(span))[: len(log.time)] > 0
    reached = np.abs(np.roll(carried, -span, axis=0)) + np.abs(carried)
    return np.asarray(crossing * np.sign(carried) * np.minimum(reached, 2.0) * (coulomb > 0))


def ripple(periods: float, share: float) -> Change:
    """Return torque that comes and goes over position, so often a turn and over Coulomb friction [1]."""

    def change(log: RobotLog, coulomb: Array, _: Array) -> Array:
        return np.asarray(share * coulomb * np.sin(periods * log.position + np.arange(len(coulomb))))

    return change


def late(seconds: float) -> Change:
    """Return what a torque is off that comes so much later [s]."""

    def change(log: RobotLog, coulomb: Array, _: Array) -> Array:
        rows = np.maximum(np.arange(len(log.time)) - round(seconds / float(np.median(np.diff(log.time)))), 0)
        return np.asarray((log.torque[rows] - log.torque) * (coulomb > 0))

    return change


def turned(log: RobotLog, coulomb: Array, _: Array) -> Array:
    """Return what turns the torque's sign."""
    return np.asarray(-2 * log.torque * (coulomb > 0))


IN_SOME: dict[str, tuple[str, Change]] = {
    "load": ("load", load),
    "drift": ("drift", drift),
    "presliding": ("presliding", presliding),
    "play": ("play", play),
    "ripple, 18 a turn": ("ripple", ripple(18, 0.3)),
    "ripple, 60 a turn": ("ripple", ripple(60, 0.3)),
    "one torque 5 ms late": ("delay", late(0.005)),
    "wrong sign": ("sign", turned),
}
"""By name: the cause, and what it adds to the torques of some joints."""

ENTIRE: dict[str, tuple[str, Case]] = {
    "A": ("", USUAL["A"]),
    "B": ("", USUAL["B"]),
    "A, joints differ": ("", USUAL["A, joints differ"]),
    "A, wrong model and calibration": ("model", USUAL["A, wrong model and calibration"]),
    **{
        name: (cause, CONDITIONS[name])
        for name, cause in {
            "14-bit encoders": "quantisation",
            "16-bit encoders": "quantisation",
            "coloured torque noise": "noise",
            "torque ripple": "ripple",
            "gains 3 % wrong": "gains",
            "torques 2 ms late": "delay",
            "IMU tilted by 1.5 deg": "tilt",
            "contacts 20 ms late": "contacts",
            "2 kg not in the model": "payload",
            "spikes in torques": "spikes",
            "rotor inertias 20 % wrong": "rotors",
            "pushed": "pushed",
            "several at once": "several",
        }.items()
    },
}
"""By name: the cause, and the case of the walks."""


@cache
def walks_of(name: str) -> tuple[Simulated, ...]:
    """Return the walks of a robot, 50 s in all."""
    diagonal, _, turning, pushed = other_walks(name)
    return diagonal, turning, pushed


def of_walks(name: str, case: str, seed: int) -> tuple[str, tuple[str, ...], Robot, list[RobotLog]]:
    """Return the cause of a case, the joints that have it, the robot and its logs; no joints if it is in all."""
    walks = list(walks_of(name))
    if case in ENTIRE:
        cause, conditions = ENTIRE[case]
        walks, robot, logs = as_seen(walks, conditions, seed)
        return cause, (), robot, logs[:2] if case != "pushed" else logs[::2]
    cause, change = IN_SOME[case]
    joints = tuple(walks[0].truth.parameters)[seed % 3 :: 3]
    walks = [_changed(walk, change, joints) for walk in walks[:2]]
    _, robot, logs = as_seen(walks, USUAL["A"], seed)
    return cause, joints, robot, logs


def _changed(walk: Simulated, change: Change, joints: tuple[str, ...]) -> Simulated:
    coulomb = np.array(
        [walk.truth.parameters.get(name, {}).get("coulomb", 0.0) * (name in joints) for name in walk.log.joint_names]
    )
    carried = walk.log.torque - walk.truth.friction_torque
    added = change(walk.log, coulomb, carried) * (coulomb > 0)
    return replace(walk, log=replace(walk.log, torque=walk.log.torque + added))


FRICTION = {
    "viscous": 0.3,
    "coulomb": 1.2,
    "stribeck_gain": 0.3,
    "stribeck_velocity": 0.15,
    "offset": 0.2,
    "slope": 50.0,
}
"""Of all joints of the arm."""

ON_THE_ARM = [
    "A",
    "B",
    *IN_SOME,
    "14-bit encoders",
    "10-bit encoders",
    "all torques 4 ms late",
    "1 kg not in the model",
]


def of_the_arm(case: str, seed: int) -> tuple[str, tuple[str, ...], Robot, list[RobotLog]]:
    """Return the cause of a case, the joints that have it, the arm and its log of 20 s."""
    robot = Robot.from_file(MODELS / "arm.toml")
    law = get_law("stribeck")
    heavier = _with_payload(robot, 1.0) if case == "1 kg not in the model" else robot
    log, truth = exact_log(heavier, law, dict.fromkeys(robot.joint_names, FRICTION), duration=20.0, seed=seed)
    log, cause = replace(log, velocity=None, acceleration=None), ""
    joints: tuple[str, ...] = ()
    if case in IN_SOME:
        cause, change = IN_SOME[case]
        joints = robot.joint_names[seed % 3 :: 3]
        coulomb = np.array([FRICTION["coulomb"] * (name in joints) for name in log.joint_names])
        added = change(log, coulomb, log.torque - truth.friction_torque) * (coulomb > 0)
        log = replace(log, torque=log.torque + added)
    if case == "all torques 4 ms late":
        cause = "delay"
        log = replace(log, torque=log.torque[np.maximum(np.arange(len(log.time)) - 4, 0)])
    if case == "1 kg not in the model":
        cause = "payload"
    noise = USUAL["B" if case == "B" else "A"]
    log = with_noise(log, position=noise.encoder, torque=noise.torque, seed=seed)
    if case.endswith("-bit encoders"):
        cause, step = "quantisation", 2 * np.pi / 2 ** int(case.removesuffix("-bit encoders"))
        log = replace(log, position=step * np.round(log.position / step))
    return cause, joints, robot, [log]


def _with_payload(robot: Robot, mass: float) -> Robot:
    """Return the robot with a point mass on its last link."""
    model = pin.Model(robot.tree.model)
    away = pin.Inertia(mass, np.array([0.0, 0.0, 0.08]), np.zeros((3, 3)))
    model.inertias[model.njoints - 1] = model.inertias[model.njoints - 1] + away
    return replace(robot, tree=replace(robot.tree, model=model))
