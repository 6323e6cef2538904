"""Coverage of the 95 % intervals on whole logs: noisy positions and torques in, parameters out.

    python studies/log_coverage.py --repetitions 200 --save studies/log_coverage.json

For each robot exact logs of random motions are made, each is given noise several times over, and the main job is run on
it as a user would: differentiated by the filter that `auto` chooses, no exact velocity, no other help. Counted over all
joints that get numbers, per parameter.
"""

import argparse
import json
import sysconfig
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from stribeck import Robot, identify
from stribeck.friction import get_law
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.prescribed.gait import Gait
from stribeck_simulation.robots.biped import MODELS
from stribeck_simulation.run import POSTURES
from stribeck_simulation.sensors.measure import with_noise

DURATION = 30.0
"""Of each log [s]."""
NOISES_PER_MOTION = 10
"""Repetitions that share a motion and differ in their noise."""
ENCODER_NOISE, TORQUE_NOISE = 1e-5, 0.1
"""[rad], [N m]"""
TRUTH = {
    "viscous": 0.2,
    "coulomb": 1.0,
    "stribeck_gain": 0.2,
    "stribeck_velocity": 0.2,
    "offset": 0.5,
    "slope": 40.0,
}
"""Of every joint, units as the law's."""
EXAMPLES = Path(sysconfig.get_path("purelib")) / "cmeel.prefix/share/example-robot-data/robots"
LEGS = ("FL", "FR", "RL", "RR")


@dataclass(frozen=True)
class Case:
    """A robot file's text, and how the robot moves."""

    robot_file: str
    gait: Gait = "walk"
    posture: dict[str, float] = field(default_factory=dict)


CASES = {
    "arm (UR5)": Case(f'[robot]\nmodel = "{EXAMPLES}/ur_description/urdf/ur5_robot.urdf"\nbase = "fixed"\n'),
    "humanoid (packaged biped)": Case(
        (MODELS / "robot.toml").read_text().replace("biped.urdf", str(MODELS / "biped.urdf")),
        "walk",
        dict(POSTURES["biped"]),
    ),
    "quadruped (Go2), one leg at a time": Case(
        f'[robot]\nmodel = "{EXAMPLES}/go2_description/urdf/go2.urdf"\n'
        + "".join(f'[contacts.{leg}]\nframe = "{leg}_foot"\nkind = "point"\n' for leg in LEGS),
        "walk",
        {f"{leg}_{joint}_joint": q for leg in LEGS for joint, q in (("hip", 0.0), ("thigh", 0.8), ("calf", -1.6))},
    ),
}


def coverage(case: Case, repetitions: int) -> dict[str, dict[str, float]]:
    """Return per parameter the coverage of the intervals, the mean relative error, and the count."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.toml"
        path.write_text(case.robot_file)
        robot = Robot.from_file(path)
    truth = {joint: TRUTH for joint in robot.joint_names if joint not in robot.position_controlled}
    held: dict[str, list[bool]] = {name: [] for name in TRUTH}
    errors: dict[str, list[float]] = {name: [] for name in TRUTH}
    for repetition in range(repetitions):
        if repetition % NOISES_PER_MOTION == 0:
            seed = repetition // NOISES_PER_MOTION
            exact, _ = exact_log(
                robot, get_law("stribeck"), truth, duration=DURATION, seed=seed, gait=case.gait, posture=case.posture
            )
        log = with_noise(exact, position=ENCODER_NOISE, torque=TORQUE_NOISE, seed=repetition)
        for joint in identify(log, robot, method="curve-fit").joints.values():
            for name, found in joint.parameters.items():
                held[name].append(found.interval_95[0] <= TRUTH[name] <= found.interval_95[1])
                errors[name].append(abs(found.value / TRUTH[name] - 1))
    return {
        name: {
            "coverage": round(float(np.mean(held[name])), 4),
            "mean_error": round(float(np.mean(errors[name])), 5),
            "intervals": len(held[name]),
        }
        for name in TRUTH
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repetitions", type=int, default=200)
    parser.add_argument("--save", type=Path, help="write the summary as JSON")
    arguments = parser.parse_args()
    summary = {}
    for label, case in CASES.items():
        summary[label] = coverage(case, arguments.repetitions)
        print(f"{label}, {arguments.repetitions} repetitions")
        for name, row in summary[label].items():
            print(
                f"  {name:20}coverage {row['coverage']:.3f} of {row['intervals']:.0f}, "
                f"mean error {100 * row['mean_error']:.2f} %",
                flush=True,
            )
    if arguments.save:
        document = {"repetitions": arguments.repetitions, "cases": summary}
        arguments.save.write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
