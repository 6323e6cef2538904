"""Score friction with known truth: legs and arms in MuJoCo, everyday logs, and the next log of real robots.

    STRIBECK_EVERYDAY=DATA_FOLDER python -m studies.legs --save studies/legs.json

- Quadrupeds: six robots trot, pace, walk, pronk and squat on ball feet (`studies.quadrupeds`), with slipping, payload,
  slope and wrong masses; the robot file does not contain the radius of the feet.
- Everyday logs: folders with logs, truth.json and a robot file or a URDF, from which `init` drafts the robot file.
- Real robots: torque errors of `studies.baselines` on the next log, relative to ordinary least squares.

A point of a friction curve is covered if its 95 % interval contains the truth. It is wrong if its joint is identified,
its interval does not contain the truth, and its error exceeds 15 %. Errors are relative to the truth; the last columns
are those of `studies.baselines`.
"""

import json
import os
from itertools import product
from pathlib import Path

import numpy as np

from stribeck import Result, Robot, identify
from stribeck.check.init import draft_robot_file
from stribeck.core.errors import StribeckError
from studies.baselines import METHODS, means
from studies.command import ROOT, Row, command, saved
from studies.coverage import counts, points_of
from studies.markdown import markdown_table, percent
from studies.quadrupeds import simulate

WAYS = METHODS | {"uncorrected": {"corrections": "none"}}
RUNS = (
    *("go2-trot-0", "a1-trot-1", "hyq-trot-2", "go2-pace-3", "b1-pace-4", "anymal-pace-5", "a1-walk-6"),
    *("solo12-walk-7", "anymal-walk-8", "go2-pronk-9", "hyq-pronk-10", "solo12-pronk-11", "a1-squat-12"),
    *("b1-squat-13", "hyq-squat-14"),
)
"""Robot, gait and seed."""
EVERYDAY, BUILT = Path(os.environ.get("STRIBECK_EVERYDAY", os.devnull)), ROOT / "build" / "legs"


def friction(truth: dict[str, float], velocity: float) -> float:
    """Compute the true friction at a speed: Coulomb and viscous friction, and the Stribeck effect if it is known."""
    excess = truth.get("gain", 0.0) * np.exp(-((velocity / truth.get("vs", 1.0)) ** 2))
    dry = truth["coulomb"] * (1 + excess) * np.tanh(velocity / truth.get("v0", 1e-9))
    return float(dry + truth["viscous"] * velocity)


def score(result: Result, truth: dict[str, dict[str, float]]) -> Row:
    """Count identified joints, and list the points of all curves."""
    points = points_of(result, truth, lambda joint, speed: friction(truth[joint], speed))
    return {"identified": sum(result.joints[name].verdict == "identified" for name in truth), "points": points}


def made(log: str) -> tuple[Path, Robot, dict[str, dict[str, float]]]:
    """Find a log, which is simulated unless it exists, its robot, and the true friction of its joints."""
    path = BUILT / log / "log.npz" if log in RUNS else EVERYDAY / log
    if log in RUNS and not path.exists():
        simulate(path.parent, *log.split("-"))
    robot, truth = path.parent / "robot.toml", json.loads((path.parent / "truth.json").read_text(encoding="utf-8"))
    if not robot.exists():
        robot = BUILT / path.parent.name / "robot.toml"
        robot.parent.mkdir(parents=True, exist_ok=True)
        draft = draft_robot_file(str(next(path.parent.glob("*.urdf"))), path, robot)
        robot.write_text(draft.text, encoding="utf-8")
    return path, Robot.from_file(robot), truth.get("joints", truth)


def run(log: str) -> Row:
    """Score a log."""
    path, machine, truth = made(log)
    row: Row = {"joints": len(truth)}
    for way, settings in WAYS.items():
        try:
            row[way] = score(identify(path, machine, machine.settings.model_copy(update=settings)), truth)
        except StribeckError as refusal:
            row[way] = {"identified": 0, "points": [], "refused": str(refusal)}
    return row


def tables(rows: list[Row]) -> list[str]:
    """Format one table of simulated gaits, everyday logs and real robots."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(row["log"].split("-")[1] if row["log"] in RUNS else row["log"], []).append(row)
    cells: list[tuple[object, ...]] = []
    for (name, group), way in product(groups.items(), WAYS):
        identified = sum(row[way]["identified"] for row in group)
        points = [point for row in group for point in row[way]["points"]]
        count, inside, wrong = counts(points)
        sizes = [percent(float(of([p[2] for p in points])), 1) if points else "–" for of in (np.median, np.max)]
        covered = f"{inside} of {count}"
        joints = f"{identified} of {sum(row['joints'] for row in group)}"
        cells.append((name, way, joints, covered, wrong, *sizes, "", ""))
    for row, way in product(saved("baselines"), METHODS):
        joints = f"{sum(row[f'identified {way}'])} of {len(row['joints']) * len(row['pairs'])}"
        disjoint = "{} of {}".format(*row[f"disjoint {way}"])
        cells.append((row["robot"], way, joints, "", "", "", "", f"{means(row, way)[0]:.2f}", disjoint))
    head = ("log", "method", "identified", "points covered", "wrong", "median", "largest", "next log", "disjoint")
    return [markdown_table(head, cells, 2)]


if __name__ == "__main__":
    everyday = (str(path.relative_to(EVERYDAY)) for path in sorted(EVERYDAY.glob("*/*.npz")))
    command(__doc__, [{"log": log} for log in (*RUNS, *everyday)], run, tables)
