"""Whether a planned motion reaches the intervals that its plan promises.

    python -m studies.plan --save studies/plan.json

Robots whose base is fixed, or hangs, move little and slowly for 20 s, every third joint not at all, with noise of 2e-5
rad and 1 N m. From what the estimator finds then a trajectory of 60 s is planned for joints that are weak or not
excited. The robot follows it exactly, torques are those of inverse dynamics with the friction that is true, and noise
is drawn anew for every seed. From the log of that plan it is planned once more, for the same joints. All that estimator
and plan know is a wrong model, as in `studies.accuracy`.

Of each joint that was planned for, half of the 95 % interval that is obtained over the one that was promised: of the
friction curve, up to the same top speed, and of the parameters. The law is named: once Coulomb and viscous friction,
which need no guess, once the smooth Stribeck law, whose shape is guessed of joints that did not move. Coverage is of
the true parameters by the obtained intervals.
"""

import argparse
import json
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from stribeck import Robot, identify, plan
from stribeck.friction import get_law
from stribeck.log import RobotLog
from stribeck.planning.plan import Plan
from stribeck.result import Result
from stribeck.robot import from_robot_file
from stribeck.settings import RobotFile
from stribeck.typing import Array
from stribeck_simulation.prescribed.ground import inverse_dynamics
from stribeck_simulation.prescribed.trajectory import Trajectory
from studies.accuracy_cases import wrong_model
from studies.log_coverage import EXAMPLES

LAWS = ("coulomb-viscous", "stribeck")
MODELS = Path(__file__).parents[1] / "src/stribeck_simulation/robots/models"
ROBOTS: dict[str, tuple[Path, dict[str, Any]]] = {
    "arm, six joints": (MODELS / "arm.urdf", {}),
    "Franka Panda": (
        EXAMPLES / "panda_description/urdf/panda.urdf",
        {"locked": {"panda_finger_joint1": 0.02, "panda_finger_joint2": 0.02}},
    ),
    "quadruped, hung": (MODELS / "quadruped.urdf", {}),
}
"""Model, and keys of [robot]."""
MEANS = {
    "viscous": 0.3,
    "coulomb": 0.8,
    "stribeck_gain": 0.3,
    "stribeck_velocity": 0.2,
    "offset": 0.3,
    "slope": 40.0,
}
"""Of the parameters; each joint's are drawn up to 30 % away."""
ENCODER, TORQUE = 2e-5, 1.0
"""White noise [rad], [N m]."""
RATE, POOR, PLANNED = 1000.0, 20.0, 60.0
"""[Hz], [s], [s]"""
HEAD = (
    "| robot | law | plan | joints | curve: median | worst | within 30 % | parameters: median | worst | within 30 % "
    "| coverage |\n"
    "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|"
)
"""Of the table."""


def robot_of(name: str) -> Robot:
    """Return a robot with a fixed base."""
    path, keys = ROBOTS[name]
    table = {"robot": {"model": path.name, "base": "fixed", **keys}}
    return from_robot_file(RobotFile.model_validate(table), path.parent / "robot.toml")


def friction_of(robot: Robot, law: str, seed: int) -> dict[str, dict[str, float]]:
    """Return each joint's true parameters."""
    generator = np.random.default_rng(seed)
    names = [parameter.name for parameter in get_law(law).parameters]
    return {joint: {name: MEANS[name] * generator.uniform(0.7, 1.3) for name in names} for joint in robot.joint_names}


def poor_motion(robot: Robot, time: Array) -> Trajectory:
    """Return a small slow swing of each joint, none of every third."""
    joints = len(robot.joint_names)
    low, high = robot.position_limits
    centre = np.where(np.isfinite(low + high), (low + high) / 2, 0.0)
    pulsation = 2 * np.pi * np.linspace(0.25, 0.45, joints)
    size = np.where(np.arange(joints) % 3 == 1, 0.0, 0.2) / pulsation
    angle = np.outer(time, pulsation)
    return Trajectory(
        centre + size * np.sin(angle), size * pulsation * np.cos(angle), -size * pulsation**2 * np.sin(angle)
    )


def log_of(
    robot: Robot, motion: Trajectory, law: str, friction: Mapping[str, Mapping[str, float]], seed: int
) -> RobotLog:
    """Return what noisy sensors say of a motion."""
    chosen = get_law(law)
    _, torque = inverse_dynamics(robot, motion, None)
    for k, joint in enumerate(robot.joint_names):
        values = np.array([friction[joint][parameter.name] for parameter in chosen.parameters])
        torque[:, k] += chosen.torque(motion.velocity[:, k], values)
    generator = np.random.default_rng(seed)
    return RobotLog(
        time=np.arange(len(torque)) / RATE,
        joint_names=robot.joint_names,
        position=motion.position + ENCODER * generator.standard_normal(torque.shape),
        torque=torque + TORQUE * generator.standard_normal(torque.shape),
    )


def run(name: str, law: str, seeds: int) -> list[dict[str, Any]]:
    """Return the ratios of one robot and law: of a plan after the poor log, and of one after the log of that plan."""
    true = robot_of(name)
    known, friction = wrong_model(true, 0), friction_of(true, law, 0)
    log = log_of(true, poor_motion(true, np.arange(round(POOR * RATE)) / RATE), law, friction, 0)
    joints, rounds = None, []
    for number in (1, 2):
        found, planned = planned_after(log, known, law, joints)
        assert planned.trajectory is not None
        state = planned.trajectory.at(np.arange(round(planned.trajectory.duration * RATE)) / RATE)
        motion = Trajectory(state.position, state.velocity, state.acceleration)
        runs = []
        for seed in range(seeds):
            log = log_of(true, motion, law, friction, 10 * number + seed)
            runs.append(compared(planned, identify(log, known, law=law), friction))
        joints = list(planned.joints)
        rounds.append(
            {
                "robot": name,
                "law": law,
                "plan": number,
                "before": {joint: found.joints[joint].verdict for joint in joints},
                "used": planned.trajectory.used,
                "clearance": planned.trajectory.clearance,
                "runs": runs,
            }
        )
    return rounds


def planned_after(log: RobotLog, robot: Robot, law: str, joints: list[str] | None) -> tuple[Result, Plan]:
    """Return what a log says, and the plan that follows from it."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        found = identify(log, robot, law=law, table=place / "friction_torque.parquet")
        (place / "result.json").write_text(found.to_json())
        return found, plan(place / "result.json", robot, joints=joints, duration=PLANNED)


def compared(planned: Plan, obtained: Result, friction: Mapping[str, Mapping[str, float]]) -> dict[str, Any]:
    """Return the obtained over the promised half widths of each joint, and which true values are covered."""
    assert planned.trajectory is not None
    found: dict[str, Any] = {}
    for joint, promise in planned.trajectory.promise.items():
        own = obtained.joints[joint]
        pairs = zip(own.curve, promise.curve, strict=True)
        parameters = {key: each for key, each in own.parameters.items() if key in promise.half_width}
        found[joint] = {
            "verdict": own.verdict,
            "curve": [rounded(one.half_width / other.half_width) for one, other in pairs],
            "parameters": {
                key: rounded(half(each.interval_95) / promise.half_width[key]) for key, each in parameters.items()
            },
            "covered": {
                key: each.interval_95[0] <= friction[joint][key] <= each.interval_95[1]
                for key, each in parameters.items()
            },
        }
    return found


def half(interval: tuple[float, float]) -> float:
    """Return half of the width of an interval."""
    return (interval[1] - interval[0]) / 2


def rounded(value: float) -> float:
    """Return a ratio to three digits."""
    return float(f"{value:.3g}")


def row(one: Mapping[str, Any]) -> str:
    """Return a line of the table."""
    joints = [joint for each in one["runs"] for joint in each.values()]
    curve = [ratio for joint in joints for ratio in joint["curve"]]
    parameters = [ratio for joint in joints for ratio in joint["parameters"].values()]
    covered = [each for joint in joints for each in joint["covered"].values()]
    return (
        f"| {one['robot']} | {one['law']} | {one['plan']} | {len(one['before'])} | {_ratios(curve)} "
        f"| {_ratios(parameters)} | {np.mean(covered):.0%} |"
    )


def _ratios(values: list[float]) -> str:
    worst = max(values, key=lambda value: abs(np.log(value)))
    near = np.mean([1 / 1.3 <= value <= 1.3 for value in values])
    return f"{np.median(values):.2f} | {worst:.2f} | {near:.0%}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", nargs="+", default=list(ROBOTS), choices=ROBOTS, help="only these")
    parser.add_argument("--laws", nargs="+", default=LAWS, choices=LAWS, help="only these")
    parser.add_argument("--seeds", type=int, default=2, help="noise drawn so often")
    parser.add_argument("--save", type=Path, help="JSON that is written")
    arguments = parser.parse_args()
    found = []
    for name in arguments.robots:
        for law in arguments.laws:
            found += run(name, law, arguments.seeds)
            if arguments.save:
                lines = ",\n".join(json.dumps(each) for each in found)
                arguments.save.write_text(f'{{"plans": [\n{lines}\n]}}\n', encoding="utf-8")
    print(HEAD, *map(row, found), sep="\n")


if __name__ == "__main__":
    main()
