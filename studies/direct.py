"""Direct identification beside the other methods: held-out torques of two arms, and a walk with known friction.

    STRIBECK_REAL_LOGS=DATA_FOLDER python -m studies.direct --save studies/direct.json

The arms are measured as `studies.held_out` measures them, whose columns of the other methods are not repeated here. The
walk is the one straight on of the TORO-like robot in `studies.accuracy`, with Coulomb and viscous friction and an
offset of the same size in place of its smooth law, so that every method may fit the law that is true. White noise is
that of case A there, 2e-5 rad and 0.1 N m; models are right, or wrong as in "A, wrong model".
"""

import argparse
import json
import os
import runpy
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from stribeck import Robot, Settings, identify, read_log
from stribeck.friction import get_law
from stribeck.log import RobotLog
from studies.accuracy_cases import CASES, ROBOTS, measured, walk_scenario, wrong_model
from studies.held_out import BANDS, ROOT, parts_of, slowest_speeds, torque_errors
from studies.kept_walks import FOLDER, kept_walk
from studies.walking_cases import WALKERS

LAW = "coulomb-viscous"
ARMS = ("tx40", "kinova-gen3")
REGRESSIONS = ("ordinary", "weighted", "robust")
OTHER_FILTER = "weighted, filter of curve-fit"
WALK_METHODS = {"curve-fit": {"method": "curve-fit"}, "whole-log": {}, "direct": {"method": "direct"}}
WALK_CASES = ("A", "A, wrong model")
NAMES = ("coulomb", "viscous")


def held_out(folder: Path, band: float) -> dict[str, dict[str, float]]:
    """Return the held-out torque errors of each joint by regression [N m], root mean square."""
    robot = Robot.from_file(folder / "robot.toml")
    parts = parts_of([read_log(path, robot) for path in sorted(folder.glob("log*.npz"))])
    slowest, found = slowest_speeds(parts), {}
    columns: dict[str, dict[str, object]] = {regression: {"regression": regression} for regression in REGRESSIONS}
    columns[OTHER_FILTER] = {"filter": Robot.from_file(folder / "curve-fit.toml").settings.filter}
    for column, own in columns.items():
        settings = robot.settings.model_copy(update={"method": "direct", "law": LAW, **own})
        errors = [
            torque_errors(
                part, robot, identify([each for each in parts if each is not part], robot, settings), band, slowest
            )
            for part in parts
        ]
        found[column] = np.sqrt(np.nanmean(np.concatenate(errors) ** 2, axis=0))
    return {
        joint: {name: float(f"{errors[k]:.3g}") for name, errors in found.items()}
        for k, joint in enumerate(robot.joint_names)
    }


def walk() -> tuple[Robot, RobotLog, dict[str, dict[str, float]]]:
    """Return robot, log and truth of the walk."""
    walked = ROBOTS["TORO-like"]
    FOLDER.mkdir(parents=True, exist_ok=True)
    robot_file = FOLDER / "TORO-like.toml"
    robot_file.write_text(WALKERS[walked.walker].robot_file, encoding="utf-8")
    simulated = kept_walk(
        "TORO-like-straight", walk_scenario(walked, walked.walks["straight"], robot_file.name), FOLDER
    )
    log, law = simulated.log, get_law(LAW)
    velocity = np.gradient(log.position, log.time, axis=0)
    torque, truth = log.torque - simulated.truth.friction_torque, {}
    for joint, known in simulated.truth.parameters.items():
        truth[joint] = {parameter.name: known[parameter.name] for parameter in law.parameters}
        column = log.joint_names.index(joint)
        torque[:, column] += law.torque(velocity[:, column], np.array(list(truth[joint].values())))
    return simulated.robot, replace(log, torque=torque, velocity=None, acceleration=None), truth


def walk_row(
    case: str, own: Mapping[str, str], robot: Robot, log: RobotLog, truth: Mapping[str, Mapping[str, float]]
) -> dict[str, float]:
    """Return relative errors of a method [%], the coverage of its intervals [%], and how many are weak."""
    believed = wrong_model(robot, 0) if CASES[case].wrong_model else robot
    result = identify(measured(log, CASES[case], 0, 0), believed, Settings.model_validate({"law": LAW, **own}))
    errors: dict[str, list[float]] = {name: [] for name in NAMES}
    covered, weak = [], 0
    for joint, known in truth.items():
        for name in set(NAMES) & set(result.joints[joint].parameters):
            found = result.joints[joint].parameters[name]
            errors[name].append(100 * abs(found.value - known[name]) / known[name])
            covered.append(found.interval_95[0] <= known[name] <= found.interval_95[1])
            weak += found.verdict == "weak"
    return {
        **{name: round(float(np.mean(own)), 1) for name, own in errors.items()},
        "worst coulomb": round(max(errors["coulomb"]), 1),
        "coverage": round(100 * float(np.mean(covered))),
        "weak": weak,
    }


def walk_table(walks: Mapping[str, Mapping[str, Mapping[str, float]]]) -> list[str]:
    """Return the rows of the walk's table, in Markdown."""
    return [
        f"| {case} | {method} | {' | '.join(f'{value:g}' for value in row.values())} |"
        for case, methods in walks.items()
        for method, row in methods.items()
    ]


def arm_table(arms: Mapping[str, Mapping[str, Mapping[str, float]]], others: Mapping[str, object]) -> list[str]:
    """Return the rows of the arms' table, with the columns of other methods from `studies/held_out.json`."""
    rows = []
    for robot, joints in arms.items():
        of_others = others[robot]
        assert isinstance(of_others, dict)
        for joint, row in joints.items():
            cells = [of_others[joint][name] for name in ("no friction", "curve-fit", "whole-log")]
            rows.append(f"| {robot} | {joint} | {' | '.join(f'{error:.3g}' for error in (*cells, *row.values()))} |")
    return rows


def main(words: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--save", type=Path, help="write the tables as JSON")
    arguments = parser.parse_args(words)
    data = os.environ.get("STRIBECK_REAL_LOGS")
    if not data:
        sys.exit("the published logs of real robots are not part of this repository: set STRIBECK_REAL_LOGS to them")
    convert = runpy.run_path(str(ROOT / "examples/real_robots/convert.py"))["convert"]
    arms = {}
    with tempfile.TemporaryDirectory() as scratch:
        for name in ARMS:
            folder = convert(name, Path(data), Path(scratch))
            arms[Robot.from_file(folder / "robot.toml").name] = held_out(folder, BANDS[name])
    others = json.loads((ROOT / "studies/held_out.json").read_text(encoding="utf-8"))["robots"]
    print("\n".join(arm_table(arms, others)), flush=True)
    robot, log, truth = walk()
    walks = {
        case: {method: walk_row(case, own, robot, log, truth) for method, own in WALK_METHODS.items()}
        for case in WALK_CASES
    }
    print("\n".join(walk_table(walks)))
    if arguments.save:
        arguments.save.write_text(json.dumps({"arms": arms, "walk": walks}, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
