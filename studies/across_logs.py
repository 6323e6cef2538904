"""Whether intervals hold across logs: of friction that two logs of a real robot identify, how many are disjoint.

    STRIBECK_REAL_LOGS=DATA_FOLDER python -m studies.across_logs --save studies/across_logs.json

Every log by itself, or the halves of the only one, is identified without any setting; of every two, the 95 % intervals
of what both identify are compared: of a joint's curve at the slowest and at the fastest speed that both have, where the
larger distance counts, and of each parameter.
"""

import argparse
import json
import os
import runpy
import sys
import tempfile
from collections.abc import Iterator, Sequence
from itertools import combinations
from pathlib import Path
from typing import TypedDict

import numpy as np

from stribeck import NothingIdentifiedError, Robot, identify, read_log
from stribeck.log import RobotLog
from stribeck.result import JointResult, ParameterEstimate
from stribeck.typing import Array

ROBOTS = ("tx40", "kinova-gen3", "go2", "double-pendulum")
HEAD = (
    "| robot | curves identified in two logs | disjoint | parameters identified in two logs | disjoint |\n"
    "|---|---:|---:|---:|---:|"
)
IDENTIFIED = "identified"


class Compared(TypedDict):
    """Of a robot: pairs of curves and of parameters that two logs identify, and how many of these are disjoint."""

    robot: str
    curves: tuple[int, int]
    parameters: tuple[int, int]


def compared(robot: Robot, fits: Sequence[dict[str, JointResult]]) -> Compared:
    """Return what fits to single logs say of each other."""
    pairs = [(a[name], b[name]) for a, b in combinations(fits, 2) for name in a if name in b]
    curves = [disjoint_curves(*pair) for pair in pairs if all(joint.verdict == IDENTIFIED for joint in pair)]
    parameters = [disjoint(*both) for pair in pairs for both in _parameters(*pair)]
    return Compared(robot=robot.name, curves=(len(curves), sum(curves)), parameters=(len(parameters), sum(parameters)))


def _parameters(a: JointResult, b: JointResult) -> Iterator[tuple[ParameterEstimate, ParameterEstimate]]:
    """Yield the parameters that both identify."""
    for name, first in a.parameters.items():
        second = b.parameters.get(name)
        if second is not None and first.verdict == second.verdict == IDENTIFIED:
            yield first, second


def disjoint(a: ParameterEstimate, b: ParameterEstimate) -> bool:
    """Return whether the intervals of two parameters are disjoint."""
    return max(a.interval_95[0], b.interval_95[0]) > min(a.interval_95[1], b.interval_95[1])


def disjoint_curves(a: JointResult, b: JointResult) -> bool:
    """Return whether the intervals of two curves are disjoint at the slowest or the fastest speed of both."""
    ends = [max(a.curve[0].velocity, b.curve[0].velocity), min(a.curve[-1].velocity, b.curve[-1].velocity)]
    (first, half), (second, other) = (_at(joint, ends) for joint in (a, b))
    return bool(np.any(np.abs(first - second) > half + other))


def _at(joint: JointResult, speeds: list[float]) -> tuple[Array, Array]:
    """Return friction and half of its interval at some speeds, between those of the curve."""
    there = [point.velocity for point in joint.curve]
    return (
        np.interp(speeds, there, [point.value for point in joint.curve]),
        np.interp(speeds, there, [point.half_width for point in joint.curve]),
    )


def _identified(log: RobotLog, robot: Robot) -> dict[str, JointResult]:
    try:
        return dict(identify(log, robot).all_friction)
    except NothingIdentifiedError:
        return {}


def _parts(logs: list[RobotLog]) -> list[RobotLog]:
    """Return the logs, or the halves of the only one."""
    middle = len(logs[0].time) // 2
    return logs if len(logs) > 1 else [logs[0].take(slice(middle)), logs[0].take(slice(middle, None))]


def study(data: Path) -> Iterator[Compared]:
    """Yield the rows of all robots."""
    convert = runpy.run_path(str(Path(__file__).parents[1] / "examples/real_robots/convert.py"))["convert"]
    with tempfile.TemporaryDirectory() as scratch:
        for name in ROBOTS:
            folder = convert(name, data, Path(scratch))
            robot = Robot.from_file(folder / "robot.toml")
            logs = _parts([read_log(path, robot) for path in sorted(folder.glob("log*.npz"))])
            yield compared(robot, [_identified(log, robot) for log in logs])


def row_of(one: Compared) -> str:
    """Return a robot's row of the table."""
    return f"| {one['robot']} | {' | '.join(str(count) for count in (*one['curves'], *one['parameters']))} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--save", type=Path, help="write the table as JSON")
    arguments = parser.parse_args()
    folder = os.environ.get("STRIBECK_REAL_LOGS")
    if not folder:
        sys.exit("the published logs of real robots are not part of this repository: set STRIBECK_REAL_LOGS to them")
    print(HEAD)
    rows: list[Compared] = []
    for one in study(Path(folder)):
        rows.append(one)
        print(row_of(one), flush=True)
    if arguments.save:
        text = ",\n".join(json.dumps(row) for row in rows)
        arguments.save.write_text(f'{{"robots": [\n{text}\n]}}\n', encoding="utf-8")


if __name__ == "__main__":
    main()
