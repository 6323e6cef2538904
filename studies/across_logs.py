"""Check intervals across logs: how often two logs of a real robot disagree about friction that both identify.

    STRIBECK_REAL_LOGS=DATA_FOLDER python -m studies.across_logs --save studies/across_logs.json

Each log is identified with default settings; a robot's only log is split into halves. For each pair of logs, the study
compares the 95 % intervals of every parameter that both identify, and of each joint's curve at the lowest and at the
highest speed that both contain. A curve disagrees if one of its two intervals is disjoint.
"""

from itertools import combinations

import numpy as np

from stribeck import NothingIdentifiedError, Robot, identify, read_log
from stribeck.log import RobotLog
from stribeck.result import JointResult, ParameterEstimate
from studies.command import Row, command, real_robot
from studies.markdown import markdown_table

ROBOTS = ("tx40", "kinova-gen3", "go2", "double-pendulum")
HEAD = ("robot", "curves identified in two logs", "disjoint", "parameters identified in two logs", "disjoint")


def run(robot: str) -> Row:
    """Count the pairs of curves and of parameters that two logs identify, and how many of these are disjoint."""
    folder = real_robot(robot)
    machine = Robot.from_file(folder / "robot.toml")
    logs = [read_log(path, machine) for path in sorted(folder.glob("log*.npz"))]
    if len(logs) == 1:
        middle = len(logs[0].time) // 2
        logs = [logs[0].take(slice(middle)), logs[0].take(slice(middle, None))]
    fits = [_identified(log, machine) for log in logs]
    pairs = [(a[name], b[name]) for a, b in combinations(fits, 2) for name in a if name in b]
    curves = [disjoint_curves(a, b) for a, b in pairs if a.verdict == b.verdict == "identified"]
    parameters = [
        disjoint(first, b.parameters[name])
        for a, b in pairs
        for name, first in a.parameters.items()
        if name in b.parameters and first.verdict == b.parameters[name].verdict == "identified"
    ]
    return {
        "name": machine.name,
        "curves": [len(curves), sum(curves)],
        "parameters": [len(parameters), sum(parameters)],
    }


def _identified(log: RobotLog, robot: Robot) -> dict[str, JointResult]:
    try:
        return dict(identify(log, robot).all_friction)
    except NothingIdentifiedError:
        return {}


def disjoint(a: ParameterEstimate, b: ParameterEstimate) -> bool:
    """Check whether the intervals of two parameters are disjoint."""
    return max(a.interval_95[0], b.interval_95[0]) > min(a.interval_95[1], b.interval_95[1])


def disjoint_curves(a: JointResult, b: JointResult) -> bool:
    """Check whether the intervals of two curves are disjoint at the slowest or the fastest speed of both."""
    ends = [max(a.curve[0].velocity, b.curve[0].velocity), min(a.curve[-1].velocity, b.curve[-1].velocity)]
    speeds = [[point.velocity for point in joint.curve] for joint in (a, b)]
    values, halves = (
        [np.interp(ends, v, [getattr(p, name) for p in joint.curve]) for v, joint in zip(speeds, (a, b), strict=True)]
        for name in ("value", "half_width")
    )
    return bool(np.any(np.abs(values[0] - values[1]) > halves[0] + halves[1]))


def tables(rows: list[Row]) -> list[str]:
    """Format the table."""
    return [markdown_table(HEAD, [(row["name"], *row["curves"], *row["parameters"]) for row in rows])]


if __name__ == "__main__":
    command(__doc__, [{"robot": robot} for robot in ROBOTS], run, tables)
