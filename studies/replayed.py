"""Measure how much better exported models explain unseen logs of real robots.

    STRIBECK_REAL_LOGS=DATA_FOLDER python -m studies.replayed --save studies/replayed.json

Friction and corrections are identified from a robot's first log, or from the first half of its only log, and exported
as MJCF, which can store rotor inertias. Another log, or the other half, is replayed.
"""

from functools import cache
from pathlib import Path

import numpy as np

from stribeck import Robot, export, identify
from stribeck.replay.replay import replay
from stribeck.replay.rollouts import HORIZONS
from studies.command import Row, command, real_robot, rounded
from studies.markdown import markdown_table

RUNS = (
    *((robot, "second half") for robot in ("tx40", "go2")),
    ("double-pendulum", "log_2"),
    *(("kinova-gen3", f"log_{k}") for k in (2, 3, 4, 5)),
)
"""Robots, and the log or half of a log that is replayed."""
SHOWN = 1
"""Index of the horizon in the table."""
MODELS = ("as given", "own friction", "exported")


def halves(log: Path) -> None:
    """Write both halves of a log next to it."""
    arrays = dict(np.load(log))
    samples = len(arrays["time"])
    for name, rows in (("first half", slice(0, samples // 2)), ("second half", slice(samples // 2, samples))):
        cut = {key: value[rows] if len(value) == samples else value for key, value in arrays.items()}
        np.savez(log.parent / f"{name}.npz", **cut)


@cache
def exported(robot: str, source: str) -> tuple[Robot, Path]:
    """Identify friction from a log of a robot, and export the model with it."""
    folder = real_robot(robot)
    if source == "first half":
        halves(folder / "log.npz")
    machine, path = Robot.from_file(folder / "robot.toml"), folder / "exported.xml"
    path.unlink(missing_ok=True)
    export(identify(folder / f"{source}.npz", machine), machine, path, "mjcf", inertia=True)
    return machine, path


def run(robot: str, replayed: str) -> Row:
    """Replay a log with the published model, with its own friction, and as exported; take medians over joints."""
    source = "first half" if replayed == "second half" else "log_1"
    machine, model = exported(robot, source)
    errors = {}
    for each in replay(model.parent / f"{replayed}.npz", machine, model).models:
        name = "exported" if Path(each.model) == model else "own friction" if each.friction else "as given"
        r2, velocity = each.median_r2(), [each.median_relative(k) for k in range(len(HORIZONS))]
        errors[name] = {
            "r2": None if r2 is None else rounded(r2),
            "velocity": [None if value is None else rounded(value) for value in velocity],
        }
    return {"name": machine.name, "found in": source, **{name: errors.get(name) for name in MODELS}}


def tables(rows: list[Row]) -> list[str]:
    """Format the table."""
    horizon = f"{1e3 * HORIZONS[SHOWN]:.0f} ms"
    head = ("robot", "found in", "replayed", "R² as given", *MODELS[1:], f"{horizon} as given", *MODELS[1:])
    cells = []
    for row in rows:
        models = [row[name] for name in MODELS]
        shown = [[None if each is None else each["r2"] for each in models]]
        shown.append([None if each is None else each["velocity"][SHOWN] for each in models])
        numbers = ["" if value is None else f"{value:.3g}" for values in shown for value in values]
        cells.append([row["name"], row["found in"], row["replayed"], *numbers])
    return [markdown_table(head, cells, 3).replace("| own friction |", "| its own friction |")]


if __name__ == "__main__":
    command(__doc__, [{"robot": robot, "replayed": log} for robot, log in RUNS], run, tables)
