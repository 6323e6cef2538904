"""How well simulated humanoids walk: falls, tilt, slip and error of the DCM, case by case.

    python -m studies.walking --save studies/walking.json

Every run walks on the estimated state, with friction in all leg joints. Tilt, slip and error are true ones, of which
the controller knows nothing. Runs that the file holds already are not repeated; at the end the table of
docs/simulation.md is printed.
"""

import argparse
import json
import tempfile
from pathlib import Path
from time import process_time
from typing import NamedTuple, TypedDict

import numpy as np
from scipy.signal import lfilter, savgol_filter

from stribeck import Robot
from stribeck.friction import Stribeck
from stribeck.typing import Array
from stribeck_simulation.friction import FrictionTruth, LawFriction
from stribeck_simulation.mujoco.model import PHYSICS_STEP, compile_body
from stribeck_simulation.robots.sole import Sole
from stribeck_simulation.run import believed_model
from stribeck_simulation.scenario import by_joint
from stribeck_simulation.sensors.profiles import get_profile
from stribeck_simulation.walking.balance.terms import Dynamics
from stribeck_simulation.walking.plan import BOTH, Plan
from stribeck_simulation.walking.simulate import Conditions, FellError, Walk, simulate_walk
from studies.walking_cases import CASES, WALKERS, Case

EVERY = 10
"""Samples from one look at the robot to the next."""
SMOOTHED = 31
"""Samples over which a velocity is found, for the encoders are noisy."""
COMMON = {"viscous": 0.2, "stribeck_gain": 0.2, "stribeck_velocity": 0.2, "slope": 40.0}
"""Of the friction in every leg joint."""


class Run(TypedDict):
    """What one run came to; zeros if it fell."""

    steps: int
    seconds: float
    fell: str  # where, or nothing
    tilt: float  # largest of the base [deg]
    slip: float  # largest of a foot while it stands alone [mm]
    error: float  # largest of the DCM, seen from the foot that stands alone [mm]
    real_time: float  # simulated over processor time


def run(case: Case, seed: int, physics_step: float = PHYSICS_STEP) -> Run:
    """Let a robot walk once, and say how it went."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.toml"
        path.write_text(WALKERS[case.robot].robot_file, encoding="utf-8")
        robot = Robot.from_file(path)
        soles = compile_body(robot, WALKERS[case.robot].soles).soles
        begin = process_time()
        try:
            walk = simulate_walk(
                robot, case.walk, WALKERS[case.robot].posture, _conditions(robot, case, seed, physics_step)
            )
        except FellError as fall:
            return Run(steps=0, seconds=0.0, fell=str(fall), tilt=0.0, slip=0.0, error=0.0, real_time=0.0)
        spent = process_time() - begin
    tilt, slip, error, _ = how_it_went(robot, walk, soles)
    seconds = walk.plan.samples * walk.plan.period
    return Run(
        steps=len(walk.plan.steps),
        seconds=round(seconds, 1),
        fell="",
        tilt=round(tilt, 2),
        slip=round(slip, 1),
        error=round(error, 1),
        real_time=round(seconds / spent, 2),
    )


def _conditions(robot: Robot, case: Case, seed: int, physics_step: float) -> Conditions:
    walker = WALKERS[case.robot]
    joints = tuple(robot.joint_names[column] for column in robot.tree.columns)
    levels = {pattern: {"coulomb": level, "offset": level} for pattern, level in walker.friction.items()}
    friction = LawFriction(joints, Stribeck(), by_joint(levels, COMMON, joints, "friction"))
    return Conditions(
        friction=FrictionTruth(len(joints), [friction]),
        profile=get_profile(case.sensors),
        seed=seed,
        pushes=case.pushes,
        believed=believed_model(robot, case.model_error, seed) if case.model_error else None,
        soles=walker.soles,
        physics_step=physics_step,
    )


class Course(NamedTuple):
    """How a walk went; errors are seen from the foot that stands alone."""

    tilt: float  # largest of the base [deg]
    slip: float  # largest of a standing foot [mm]
    error: float  # largest of the DCM [mm]
    com: float  # root mean square of the centre of mass, horizontally [mm]


def how_it_went(robot: Robot, walk: Walk, soles: dict[str, Sole]) -> Course:
    """Return how a walk went."""
    plan, truth = walk.plan, walk.truth
    assert truth.base_position is not None
    assert truth.base_orientation is not None
    assert truth.base_velocity is not None
    base = np.column_stack([truth.base_position, truth.base_orientation])
    joints = walk.log.position[:, robot.tree.columns]
    rates = savgol_filter(joints, SMOOTHED, 2, deriv=1, delta=plan.period, axis=0)
    dynamics = Dynamics(robot, soles)
    pulsation = np.sqrt(-dynamics.gravity[2] / _height(dynamics, base[0], joints[0]))
    tilt = 2 * np.degrees(np.arcsin(np.hypot(base[:, 3], base[:, 4]).max()))
    planned = _planned_com(plan, pulsation)
    slip = error = 0.0
    apart: list[Array] = []
    for number in range(len(plan.steps)):
        step = plan.steps[number]
        rows = np.flatnonzero((plan.step == number) & (plan.swing != BOTH))[::EVERY]
        places, errors = [], []
        for k in rows:
            velocity = np.concatenate([truth.base_velocity[k], rates[k]])
            terms = dynamics.at(np.concatenate([base[k], joints[k]]), velocity)
            foot = terms.feet[1 - step.foot]
            dcm = terms.com[:2] + terms.com_velocity[:2] / pulsation
            places.append(foot.place[:2])
            heading = np.arctan2(foot.rotation[1, 0], foot.rotation[0, 0])
            own, planned_own = (foot.place[:2], heading), (step.stance.place, step.stance.yaw)
            errors.append(_seen_from(*own, dcm) - _seen_from(*planned_own, plan.dcm[k]))
            apart.append(_seen_from(*own, terms.com[:2]) - _seen_from(*planned_own, planned[k]))
        slip = max(slip, float(np.linalg.norm(np.array(places) - places[0], axis=1).max()))
        error = max(error, float(np.linalg.norm(errors, axis=1).max()))
    com = float(np.sqrt(np.mean(np.sum(np.square(apart), axis=1)))) if apart else 0.0
    return Course(float(tilt), 1e3 * slip, 1e3 * error, 1e3 * com)


def _planned_com(plan: Plan, pulsation: float) -> Array:
    """Return the centre of mass that follows the planned DCM, `c' = w (xi - c)`, shape (T, 2) [m]."""
    kept = np.exp(-pulsation * plan.period)
    return np.asarray(lfilter([1 - kept], [1, -kept], plan.dcm, axis=0, zi=kept * plan.dcm[:1])[0])


def _height(dynamics: Dynamics, base: Array, joints: Array) -> float:
    return float(dynamics.at(np.concatenate([base, joints]), np.zeros(dynamics.model.nv)).com[2])


def _seen_from(place: Array, heading: float, point: Array) -> Array:
    cosine, sine = np.cos(heading), np.sin(heading)
    return np.asarray(np.array([[cosine, sine], [-sine, cosine]]) @ (point - place))


def table(cases: dict[str, dict[str, Run]]) -> list[str]:
    """Return the rows of the table in docs/simulation.md: of each case's runs the sums and the largest values."""
    lines = []
    for label, runs in cases.items():
        rows = list(runs.values())
        steps, seconds = sum(row["steps"] for row in rows), sum(row["seconds"] for row in rows)
        falls = sum(bool(row["fell"]) for row in rows)
        worst = [max(row[name] for row in rows) for name in ("tilt", "slip", "error")]
        speed = seconds / sum(row["seconds"] / row["real_time"] for row in rows if row["real_time"]) if seconds else 0.0
        lines.append(
            f"| {label} | {steps} | {seconds:.0f} | {falls} | {worst[0]:.1f} | {worst[1]:.1f} | {worst[2]:.0f} "
            f"| {speed:.1f} |"
        )
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--save", type=Path, help="JSON that is read at first, and written after every run")
    parser.add_argument("--only", default="", help="cases whose name has this in it")
    arguments = parser.parse_args()
    saved = arguments.save
    known = json.loads(saved.read_text(encoding="utf-8"))["cases"] if saved and saved.exists() else {}
    cases: dict[str, dict[str, Run]] = {label: known.get(label, {}) for label in CASES}
    for label, case in CASES.items():
        for seed in case.seeds:
            if str(seed) in cases[label] or arguments.only not in label:
                continue
            cases[label][str(seed)] = found = run(case, seed)
            print(f"{label}, seed {seed}: {found}", flush=True)
            if saved:
                saved.write_text(json.dumps({"cases": cases}, indent=1) + "\n", encoding="utf-8")
    print("\n".join(table({label: runs for label, runs in cases.items() if runs})))


if __name__ == "__main__":
    main()
