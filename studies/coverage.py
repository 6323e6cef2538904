"""Measure how often the 95 % intervals of parameters cover the truth over many noisy logs.

    python -m studies.coverage --save studies/coverage.json

For each robot, noise is added several times to exact logs of random motions. The curve fit identifies friction as users
would run it: it differentiates positions with the filter that `auto` chooses. Coverage is counted per parameter over
all joints that get numbers.

The whole log is tested on one minute of an arm's motion with noisy sensors. In one case the offset of every joint
changes at random every 1.6 s (standard deviation 0.2 N m), which no sensor noise explains.
"""

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from stribeck import Robot, Settings, identify
from stribeck.friction import get_law
from stribeck.log import RobotLog
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.prescribed.gait import Gait
from stribeck_simulation.robots import MODELS
from stribeck_simulation.run import POSTURES
from stribeck_simulation.sensors.measure import with_noise
from studies.command import Row, command
from studies.markdown import markdown_table
from studies.walking_cases import EXAMPLES

REPETITIONS, NOISES_PER_MOTION = 200, 10
ENCODER, TORQUE = 1e-5, 0.1
"""Standard deviations of the noise [rad], [N m]."""
TRUTH = {
    "coulomb": 1.0,
    "viscous": 0.2,
    "offset": 0.5,
    "stribeck_gain": 0.2,
    "stribeck_velocity": 0.2,
    "slope": 40.0,
}
"""Friction of every joint, in the units of the law `stribeck`."""
LEGS = ("FL", "FR", "RL", "RR")


@dataclass(frozen=True)
class Case:
    """Text of the robot file, motion of the robot, and size of the offsets that change every 1.6 s [N m]."""

    robot_file: str
    posture: dict[str, float] = field(default_factory=dict)
    gait: Gait = "walk"
    settings: Settings = field(default_factory=lambda: Settings(method="curve-fit"))
    truth: dict[str, float] = field(default_factory=lambda: TRUTH)
    duration: float = 30.0
    uneven: float = 0.0


def _packaged(name: str, model: str) -> str:
    return (MODELS / name).read_text(encoding="utf-8").replace(model, str(MODELS / model))


ARM = Case(
    _packaged("arm.toml", "arm.urdf"),
    settings=Settings(law="coulomb-viscous", method="whole-log", corrections="none", rest=0.01),
    truth={"viscous": 0.3, "coulomb": 1.2, "offset": 0.2},
    duration=60.0,
)
CASES = {
    "arm (UR5)": Case(f'[robot]\nmodel = "{EXAMPLES}/ur_description/urdf/ur5_robot.urdf"\nbase = "fixed"\n'),
    "humanoid (packaged biped)": Case(_packaged("robot.toml", "biped.urdf"), dict(POSTURES["biped"])),
    "quadruped (Go2), one leg at a time": Case(
        f'[robot]\nmodel = "{EXAMPLES}/go2_description/urdf/go2.urdf"\n'
        + "".join(f'[contacts.{leg}]\nframe = "{leg}_foot"\nkind = "point"\n' for leg in LEGS),
        {f"{leg}_{joint}_joint": q for leg in LEGS for joint, q in (("hip", 0.0), ("thigh", 0.8), ("calf", -1.6))},
    ),
    "steps agree": ARM,
    "steps disagree": replace(ARM, uneven=0.2),
}


def robot_of(case: Case) -> Robot:
    """Read a case's robot."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.toml"
        path.write_text(case.robot_file, encoding="utf-8")
        return Robot.from_file(path)


def logs_of(case: Case, robot: Robot, repetitions: int) -> Iterator[RobotLog]:
    """Make the noisy logs of a case, one after another."""
    law = get_law("stribeck" if "slope" in case.truth else "coulomb-viscous")
    truth = {joint: case.truth for joint in robot.joint_names if joint not in robot.position_controlled}
    for seed in range(repetitions):
        if seed % NOISES_PER_MOTION == 0:
            motion = 5 if case.truth is ARM.truth else seed // NOISES_PER_MOTION
            exact, _ = exact_log(
                robot, law, truth, duration=case.duration, seed=motion, gait=case.gait, posture=case.posture
            )
        log = with_noise(exact, position=ENCODER, torque=TORQUE, seed=seed)
        stretch = (log.time / 1.6).astype(int)
        offsets = np.random.default_rng([seed, 1]).standard_normal((stretch[-1] + 1, len(log.joint_names)))
        yield replace(log, torque=log.torque + case.uneven * offsets[stretch])


def run(case: str, repetitions: int) -> Row:
    """Compute, per parameter, the coverage of the intervals [1] and the mean relative error [1]."""
    made = CASES[case]
    robot = robot_of(made)
    joints = [
        joint
        for log in logs_of(made, robot, repetitions)
        for joint in identify(log, robot, made.settings).joints.values()
        if joint.parameters
    ]
    parameters = {}
    for name, true in made.truth.items():
        found = [joint.parameters[name] for joint in joints]
        held = [each.interval_95[0] <= true <= each.interval_95[1] for each in found]
        parameters[name] = {
            "coverage": round(float(np.mean(held)), 4),
            "mean_error": round(float(np.mean([abs(each.value / true - 1) for each in found])), 5),
            "intervals": len(held),
        }
    return {"parameters": parameters}


def tables(rows: list[Row]) -> list[str]:
    """Format the tables of robots, and of an arm with constant or changing offsets."""
    robots, steps = [], []
    for row in rows:
        shares = {name: 100 * each["coverage"] for name, each in row["parameters"].items()}
        if CASES[row["case"]].truth is TRUTH:
            errors = [f"{100 * row['parameters'][name]['mean_error']:.2f} %" for name in TRUTH]
            held = f"{min(shares.values()):.1f} to {max(shares.values()):.1f} %"
            robots.append((row["case"], *errors, held))
        else:
            steps.append((row["case"], *(f"{shares[name]:.0f} %" for name in ARM.truth)))
    head = ("robot", "Coulomb", "viscous", "offset", "Stribeck gain", "Stribeck velocity", "slope", "coverage")
    return [markdown_table(head, robots), markdown_table(("case", "viscous", "Coulomb", "offset"), steps)]


if __name__ == "__main__":
    keys = [{"case": case, "repetitions": REPETITIONS if made.truth is TRUTH else 20} for case, made in CASES.items()]
    command(__doc__, keys, run, tables)
