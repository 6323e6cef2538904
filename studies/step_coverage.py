"""Coverage of 95 % intervals where steps agree, and where they disagree.

    python -m studies.step_coverage --repetitions 20 --save studies/step_coverage.json

An arm moves for a minute, its sensors are noisy; in one case every stretch of 1.6 s has an offset of its own in every
joint, 0.2 N m, which no sensor's noise explains.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from stribeck import Robot, identify
from stribeck.friction import get_law
from stribeck.log import RobotLog
from stribeck.settings import Settings
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.robots.biped import MODELS
from stribeck_simulation.sensors.measure import with_noise

LAW = "coulomb-viscous"
TRUTH = {"viscous": 0.3, "coulomb": 1.2, "offset": 0.2}
"""Of every joint."""
DURATION, STRETCH = 60.0, 1.6
"""Of the log, and of what has an offset of its own [s]."""
ENCODER, TORQUE, UNEVEN = 1e-5, 0.1, 0.2
"""Noise [rad], [N m], and the offsets' standard deviation [N m]."""
CASES = {"steps agree": 0.0, "steps disagree": UNEVEN}


def measured(exact: RobotLog, uneven: float, seed: int) -> RobotLog:
    """Return the log with noise, and with offsets that come and go."""
    log = with_noise(exact, position=ENCODER, torque=TORQUE, seed=seed)
    generator = np.random.default_rng([seed, 1])
    offsets = uneven * generator.standard_normal((int(DURATION / STRETCH) + 1, len(log.joint_names)))
    return replace(log, torque=log.torque + offsets[(log.time / STRETCH).astype(int)])


def study(repetitions: int) -> dict[str, dict[str, float]]:
    """Return the table: case, parameter; printed row by row."""
    robot = Robot.from_file(MODELS / "arm.toml")
    exact, _ = exact_log(robot, get_law(LAW), dict.fromkeys(robot.joint_names, TRUTH), duration=DURATION, seed=5)
    table: dict[str, dict[str, float]] = {}
    for case, uneven in CASES.items():
        logs = [measured(exact, uneven, seed) for seed in range(repetitions)]
        settings = Settings(law=LAW, method="whole-log", corrections="none", rest=0.01)
        joints = [joint for log in logs for joint in identify(log, robot, settings).joints.values()]
        table[case] = {
            name: float(np.mean([low <= truth <= high for low, high in intervals]))
            for name, truth in TRUTH.items()
            for intervals in [[joint.parameters[name].interval_95 for joint in joints]]
        }
        print(row_of(case, table[case]), flush=True)
    return table


def row_of(case: str, held: dict[str, float]) -> str:
    """Return the table's row in Markdown."""
    return f"| {case} | {' | '.join(f'{100 * share:.0f} %' for share in held.values())} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repetitions", type=int, default=20)
    parser.add_argument("--save", type=Path, help="write the table as JSON")
    arguments = parser.parse_args()
    table = study(arguments.repetitions)
    if arguments.save:
        document = {"repetitions": arguments.repetitions, "cases": table}
        arguments.save.write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
