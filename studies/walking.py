"""Measure how well simulated humanoids walk: falls, tilt, slip and error of the DCM per case.

    python -m studies.walking --save studies/walking.json

The controller uses the estimated state; all leg joints have friction. Tilt, slip and error refer to the true state.
"""

from functools import partial
from time import process_time

import numpy as np
from scipy.signal import savgol_filter

from stribeck import Robot
from stribeck.core.base.typing import Array
from stribeck.core.friction import Stribeck
from stribeck.simulation.friction import FrictionTruth, LawFriction
from stribeck.simulation.mujoco.model import PHYSICS_STEP, compile_body
from stribeck.simulation.run import believed_model
from stribeck.simulation.scenario import by_joint
from stribeck.simulation.sensors.profiles import get_profile
from stribeck.simulation.walking.balance.terms import Dynamics
from stribeck.simulation.walking.plan import BOTH
from stribeck.simulation.walking.simulate import Conditions, FellError, Walk, simulate_walk
from studies.accuracy_cases import COMMON
from studies.changes import known
from studies.command import Row, command, of_code
from studies.markdown import markdown_table
from studies.walking_cases import CASES, WALKERS, Case, robot_of

EVERY = 10
"""Number of samples between two evaluations of the robot's state."""
SMOOTHED = 31
"""Number of samples over which a velocity is averaged, because encoders are noisy."""
HEAD = ("walk", "steps", "time [s]", "falls", "tilt [deg]", "slip [mm]", "DCM [mm]", "speed")


def run(case: str, seed: int) -> Row:
    """Simulate one walk of a case."""
    return walk_once(CASES[case], seed)


def walk_once(case: Case, seed: int, physics_step: float = PHYSICS_STEP) -> Row:
    """Simulate and measure one walk; all measures of a fall are zero."""
    robot, walker = robot_of(case.robot), WALKERS[case.robot]
    conditions = Conditions(
        friction=leg_friction(case.robot, robot),
        profile=get_profile(case.sensors),
        seed=seed,
        pushes=case.pushes,
        believed=believed_model(robot, case.model_error, seed) if case.model_error else None,
        soles=walker.soles,
        physics_step=physics_step,
    )
    begin = process_time()
    try:
        walk = simulate_walk(robot, case.walk, walker.posture, conditions)
    except FellError as fall:
        return dict.fromkeys(("steps", "seconds", "tilt", "slip", "error", "real_time"), 0) | {"fell": str(fall)}
    spent = process_time() - begin
    seconds = walk.plan.samples * walk.plan.period
    run = {"steps": len(walk.plan.steps), "seconds": round(seconds, 1), "fell": ""}
    return run | how_it_went(case.robot, robot, walk) | {"real_time": round(seconds / spent, 2)}


def leg_friction(name: str, robot: Robot) -> FrictionTruth:
    """Make the simulated friction of every leg joint."""
    joints = tuple(robot.joint_names[column] for column in robot.tree.columns)
    levels = {pattern: {"coulomb": level, "offset": level} for pattern, level in WALKERS[name].friction.items()}
    return FrictionTruth(len(joints), [LawFriction(joints, Stribeck(), by_joint(levels, COMMON, joints, "friction"))])


def how_it_went(name: str, robot: Robot, walk: Walk) -> dict[str, float]:
    """Measure the largest tilt of the base [deg], slip, and DCM error relative to the foot in single support [mm]."""
    plan, truth = walk.plan, walk.truth
    base = np.column_stack([known(truth.base_position), known(truth.base_orientation)])
    base_rates = known(truth.base_velocity)
    joints = walk.log.position[:, robot.tree.columns]
    rates = savgol_filter(joints, SMOOTHED, 2, deriv=1, delta=plan.period, axis=0)
    dynamics = Dynamics(robot, compile_body(robot, WALKERS[name].soles).soles)
    start = dynamics.at(np.concatenate([base[0], joints[0]]), np.zeros(dynamics.model.nv))
    pulsation = np.sqrt(-dynamics.gravity[2] / start.com[2])
    tilt = 2 * np.degrees(np.arcsin(np.hypot(base[:, 3], base[:, 4]).max()))
    slip = error = 0.0
    for number, step in enumerate(plan.steps):
        places, errors = [], []
        for k in np.flatnonzero((plan.step == number) & (plan.swing != BOTH))[::EVERY]:
            velocity = np.concatenate([base_rates[k], rates[k]])
            terms = dynamics.at(np.concatenate([base[k], joints[k]]), velocity)
            foot = terms.feet[1 - step.foot]
            dcm = terms.com[:2] + terms.com_velocity[:2] / pulsation
            places.append(foot.place[:2])
            yaw = np.arctan2(foot.rotation[1, 0], foot.rotation[0, 0])
            planned = _seen_from(step.stance.place, step.stance.yaw, plan.dcm[k])
            errors.append(_seen_from(foot.place[:2], yaw, dcm) - planned)
        slip = max(slip, float(np.linalg.norm(np.array(places) - places[0], axis=1).max()))
        error = max(error, float(np.linalg.norm(errors, axis=1).max()))
    return {"tilt": round(float(tilt), 2), "slip": round(1e3 * slip, 1), "error": round(1e3 * error, 1)}


def _seen_from(place: Array, heading: float, point: Array) -> Array:
    cosine, sine = np.cos(heading), np.sin(heading)
    return np.asarray(np.array([[cosine, sine], [-sine, cosine]]) @ (point - place))


def tables(rows: list[Row]) -> list[str]:
    """Format the table of docs/simulation.md: sums and largest values of the runs of each case."""
    cells = []
    for case in CASES:
        if not (own := [row for row in rows if row["case"] == case]):
            continue
        steps, seconds = sum(row["steps"] for row in own), sum(row["seconds"] for row in own)
        tilt, slip, error = (max(row[name] for row in own) for name in ("tilt", "slip", "error"))
        speed = seconds / sum(row["seconds"] / row["real_time"] for row in own if row["real_time"]) if seconds else 0.0
        falls = sum(bool(row["fell"]) for row in own)
        numbers = (f"{seconds:.0f}", falls, f"{tilt:.1f}", f"{slip:.1f}", f"{error:.0f}", f"{speed:.1f}")
        cells.append((case, steps, *numbers))
    return [markdown_table(HEAD, cells)]


if __name__ == "__main__":
    keys = [{"case": name, "seed": seed} for name, case in CASES.items() for seed in case.seeds]
    command(__doc__, keys, run, tables, partial(of_code, "simulation"))
