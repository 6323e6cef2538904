"""Compare the intervals that a planned motion obtains with the intervals that its plan predicts.

    python -m studies.plan --save studies/plan.json

Robots with a fixed or hanging base first move little and slowly for 20 s, every third joint not at all, with noise of
2e-5 rad and 1 N m. From this result, a trajectory of 60 s is planned for joints that are weak or not excited. The robot
follows it exactly, with torques from inverse dynamics plus the true friction, and noise drawn for every seed. The log
of this plan leads to a second plan for the same joints. Estimator and plan use a wrong model, as in
`studies.accuracy`.

Walking robots walk 30 s at half their pace, with noise of 2e-5 rad and so much torque noise that many joints are weak.
The plan predicts the intervals of a longer walk and of a walk at twice the pace with the same duration. Both walks are
simulated exactly, get independent noise, and are identified.

The study measures, per joint, the half width of the obtained 95 % interval of the friction curve divided by the
predicted one, at the same three speeds. The law is given: Coulomb and viscous friction, which need no guess, or the
smooth Stribeck law, whose shape is guessed for joints that did not move.
"""

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from stribeck import Robot, identify, plan
from stribeck.core.base.typing import Array
from stribeck.core.friction import get_law
from stribeck.core.log import RobotLog
from stribeck.core.result import JointResult, Result
from stribeck.design.planning.joint import PlannedJoint, Reach
from stribeck.design.planning.plan import Plan
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.prescribed.ground import inverse_dynamics
from stribeck.simulation.robots import MODELS
from stribeck.simulation.run import POSTURES
from stribeck.simulation.sensors.measure import with_noise
from studies.accuracy_cases import wrong_model
from studies.changes import EXAMPLES, robot_from
from studies.command import Row, command, rounded
from studies.markdown import markdown_table

LINEAR, STRIBECK = "coulomb-viscous", "stribeck"
FIXED = '[robot]\nmodel = "{}"\nbase = "fixed"\n'
ROBOTS = {
    "arm, six joints": FIXED.format(MODELS / "arm.urdf"),
    "Franka Panda": FIXED.format(EXAMPLES / "panda_description/urdf/panda.urdf")
    + "locked = { panda_finger_joint1 = 0.02, panda_finger_joint2 = 0.02 }\n",
    "quadruped, hung": FIXED.format(MODELS / "quadruped.urdf"),
}
"""Robot files of robots with a fixed or hanging base."""
WALKERS = {"TORO-like": ("toro.toml", "toro", 6.0), "quadruped": ("quadruped.toml", "quadruped", 3.0)}
"""Walking robots: robot file, posture, and torque noise [N m]."""
MEANS = {"viscous": 0.3, "coulomb": 0.8, "stribeck_gain": 0.3, "stribeck_velocity": 0.2, "offset": 0.3, "slope": 40.0}
"""Means of the parameters; each joint's parameters are drawn within 30 % of them."""
SEEDS = 2
"""Number of times that noise is drawn for a plan."""
ENCODER, TORQUE, RATE = 2e-5, 1.0, 1000.0
"""White noise [rad], [N m], and rate [Hz] of planned motions."""
WALK, TIMES = 30.0, 4
"""Duration of the present walk [s], and how many times as long the longer one is."""
FASTER = "the present motion twice as fast"
HEAD = ("robot", "law", "plan", "joints", "curve: median", "worst", "within 30 %")
WALK_HEAD = ("robot", "joints", "weak before", "walk", "curve: median, slow", "middle", "top", "worst", "within 30 %")


def friction_of(robot: Robot, law: str) -> dict[str, dict[str, float]]:
    """Draw each joint's true parameters."""
    generator = np.random.default_rng(0)
    names = [parameter.name for parameter in get_law(law).parameters]
    return {joint: {name: MEANS[name] * generator.uniform(0.7, 1.3) for name in names} for joint in robot.joint_names}


def poor_motion(robot: Robot, time: Array) -> Array:
    """Make a small and slow motion, every third joint at rest, as a trajectory of shape (3, T, n)."""
    joints = len(robot.joint_names)
    low, high = robot.position_limits
    centre = np.where(np.isfinite(low + high), (low + high) / 2, 0.0)
    pulsation = 2 * np.pi * np.linspace(0.25, 0.45, joints)
    size = np.where(np.arange(joints) % 3 == 1, 0.0, 0.2) / pulsation
    angle = np.outer(time, pulsation)
    position, velocity = centre + size * np.sin(angle), size * pulsation * np.cos(angle)
    return np.array([position, velocity, -size * pulsation**2 * np.sin(angle)])


def log_of(robot: Robot, motion: Array, law: str, seed: int) -> RobotLog:
    """Record a motion with noisy sensors."""
    chosen, friction = get_law(law), friction_of(robot, law)
    _, torque = inverse_dynamics(robot, motion, None)
    for k, joint in enumerate(robot.joint_names):
        values = np.array([friction[joint][parameter.name] for parameter in chosen.parameters])
        torque[:, k] += chosen.torque(motion[1, :, k], values)
    time = np.arange(len(torque)) / RATE
    log = RobotLog(time=time, joint_names=robot.joint_names, position=motion[0], torque=torque)
    return with_noise(log, position=ENCODER, torque=TORQUE, seed=seed)


def run(robot: str, law: str, **number: int) -> Row:
    """Compare obtained with predicted intervals of two consecutive plans or of one walk."""
    return walked(robot, number["walk"]) if "walk" in number else two_plans(robot, law)[number["plan"] - 1]


@cache
def two_plans(name: str, law: str) -> list[Row]:
    """Compare the intervals after a plan from the poor log and after a second plan from the first plan's log."""
    true = robot_from(ROBOTS[name])
    known, joints, rounds = wrong_model(true, 0), None, []
    log = log_of(true, poor_motion(true, np.arange(20 * round(RATE)) / RATE), law, 0)
    for number in (1, 2):
        found, planned = planned_after(log, known, law, joints, duration=60.0)
        trajectory = planned.trajectory
        assert trajectory is not None
        state = trajectory.at(np.arange(round(trajectory.duration * RATE)) / RATE)
        motion, runs = np.array([state.position, state.velocity, state.acceleration]), []
        for seed in range(SEEDS):
            log = log_of(true, motion, law, 10 * number + seed)
            runs.append(compared(planned, identify(log, known, law=law)))
        joints = list(planned.joints)
        before = {joint: found.joints[joint].verdict for joint in joints}
        rounds.append({"before": before, "used": trajectory.used, "clearance": trajectory.clearance, "runs": runs})
    return rounds


def planned_after(
    log: RobotLog, robot: Robot, law: str, joints: list[str] | None, duration: float | None = None
) -> tuple[Result, Plan]:
    """Identify friction from a log, and plan from the result for the given joints or for all joints with friction."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        found = identify(log, robot, law=law, table=place / "friction_torque.parquet")
        (place / "result.json").write_text(found.to_json())
        options: dict[str, Any] = {"duration": duration} if duration else {"joints": _with_friction(found)}
        return found, plan(place / "result.json", robot, **{"joints": joints, **options})


def _with_friction(found: Result) -> list[str]:
    return [joint for joint, own in found.joints.items() if own.curve and own.verdict != "no friction"]


def compared(planned: Plan, obtained: Result) -> Row:
    """Divide each joint's obtained by its predicted half widths."""
    assert planned.trajectory is not None
    found: Row = {}
    for joint, promise in planned.trajectory.promise.items():
        own = obtained.joints[joint]
        pairs = zip(own.curve, promise.curve, strict=True)
        found[joint] = {
            "verdict": own.verdict,
            "curve": [rounded(one.half_width / other.half_width) for one, other in pairs],
        }
    return found


def walk_log(name: str, seconds: float, pace: float, path: int, noise: int) -> tuple[Robot, RobotLog]:
    """Read a robot, and make the log of one of its walks."""
    file, posture, std = WALKERS[name]
    robot = Robot.from_file(MODELS / file)
    friction = friction_of(robot, LINEAR)
    log, _ = exact_log(
        robot, get_law(LINEAR), friction, duration=seconds, rate=500.0, seed=path, posture=POSTURES[posture], pace=pace
    )
    return robot, with_noise(replace(log, foot_wrench=None), position=ENCODER, torque=std, seed=noise)


def walked(name: str, seed: int) -> Row:
    """Compare obtained with predicted intervals of a longer and of a faster walk."""
    robot, log = walk_log(name, WALK, 0.5, seed, 10 * seed)
    known = wrong_model(robot, 0)
    found, planned = planned_after(log, known, LINEAR, None)
    longer = identify(walk_log(name, TIMES * WALK, 0.5, seed, 10 * seed + 1)[1], known, law=LINEAR)
    faster = identify(walk_log(name, WALK, 1.0, seed, 10 * seed + 2)[1], known, law=LINEAR)
    joints = {}
    for joint in _with_friction(found):
        now = found.joints[joint]
        nowhere, flags = Reach(middle=0.0, amplitude=0.0, speed=0.0), {"guessed": False, "prismatic": False}
        share = PlannedJoint(column=0, result=now, settings=known.settings, reach=nowhere, **flags).shrinking_share
        half = np.array([point.half_width for point in now.curve]) * np.sqrt(share / TIMES + 1 - share)
        promised = next(each for each in planned.joints[joint].candidates if each.motion == FASTER).curve
        widths = np.array([point.half_width for point in promised])
        joints[joint] = {
            "before": now.verdict,
            "longer": ratios(longer.joints[joint], [point.velocity for point in now.curve], half),
            "faster": ratios(faster.joints[joint], [point.velocity for point in promised], widths),
        }
    return {"joints": joints}


def ratios(joint: JointResult, speeds: Sequence[float], promised: Array) -> list[float]:
    """Divide the half width of Coulomb + viscous friction at three speeds by the predicted half widths."""
    assert joint.correlation is not None
    names = list(joint.parameters)
    own = [names.index(name) for name in ("coulomb", "viscous")]
    errors = np.array([joint.parameters[names[k]].standard_error for k in own])
    covariance = np.array(joint.correlation)[np.ix_(own, own)] * np.outer(errors, errors)
    slopes = np.column_stack([np.ones(len(speeds)), speeds])
    quantile = np.mean([point.half_width / point.standard_error for point in joint.curve])
    half = quantile * np.sqrt(np.einsum("sp,pq,sq->s", slopes, covariance, slopes))
    return [rounded(value) for value in half / promised]


def tables(rows: list[Row]) -> list[str]:
    """Format the tables of planned trajectories and of walks."""
    planned = []
    for row in (row for row in rows if "plan" in row):
        joints = [joint for each in row["runs"] for joint in each.values()]
        curve = [ratio for joint in joints for ratio in joint["curve"]]
        cells = [row["robot"], row["law"], row["plan"], len(row["before"]), f"{np.median(curve):.2f}"]
        planned.append([*cells, *_extremes(curve)])
    walks = []
    for name in WALKERS:
        joints = [joint for row in rows if row["robot"] == name for joint in row["joints"].values()]
        weak = sum(joint["before"] != "identified" for joint in joints)
        for key, label in (("longer", f"{TIMES} times as long"), ("faster", "twice as fast")):
            values = np.array([joint[key] for joint in joints]).reshape(-1, 3)
            if len(values):
                medians = [f"{value:.2f}" for value in np.median(values, axis=0)]
                walks.append([name, len(joints), weak, label, *medians, *_extremes(values.ravel().tolist())])
    return [markdown_table(HEAD, planned, 2), markdown_table(WALK_HEAD, walks)]


def _extremes(values: list[float]) -> tuple[str, str]:
    """Format the worst ratio, and the share within 30 %."""
    worst = max(values, key=lambda value: abs(np.log(value)))
    return f"{worst:.2f}", f"{np.mean([1 / 1.3 <= value <= 1.3 for value in values]):.0%}"


if __name__ == "__main__":
    plans = product(ROBOTS, (LINEAR, STRIBECK), (1, 2))
    keys: list[Row] = [{"robot": robot, "law": law, "plan": number} for robot, law, number in plans]
    keys += [{"robot": robot, "law": LINEAR, "walk": seed} for robot in WALKERS for seed in range(3)]
    command(__doc__, keys, run, tables)
