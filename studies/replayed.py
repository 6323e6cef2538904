"""Measure how much better exported models explain unseen logs of real robots.

    STRIBECK_REAL_LOGS=DATA_FOLDER python -m studies.replayed --save studies/replayed.json

Friction is identified from a robot's first log, or from the first half of its only log, and exported as MJCF. Another
log, or the other half, is replayed; if it has commands, the model is also simulated freely under them.
"""

from functools import cache
from pathlib import Path

import numpy as np

from stribeck import Robot, export, identify
from stribeck.design.replaying.replay import replay
from stribeck.design.replaying.rollouts import HORIZONS
from studies.command import Row, command, of_estimates, real_robot, rounded
from studies.markdown import markdown_table

RUNS = (
    *((robot, "second half") for robot in ("tx40", "go2", "aliengo")),
    *(("go2-ten-logs", "log_1"), ("double-pendulum", "log_2")),
    *(("kinova-gen3", f"log_{k}") for k in (2, 3, 4, 5)),
)
"""Robots, and the log or half of a log that is replayed."""
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
    export(identify(folder / f"{source}.npz", machine), machine, path, "mjcf")
    return machine, path


def run(robot: str, replayed: str) -> Row:
    """Replay a log with the published model, with its own friction, and as exported; take medians over joints."""
    source = {"second half": "first half", "log_1": "log_0"}.get(replayed, "log_1")
    machine, model = exported(robot, source)
    more = [model.parent / f"log_{k}.npz" for k in (2, 3, 4) if source == "log_0"]
    errors, found = {}, replay(model.parent / f"{replayed}.npz", machine, model, more=more)
    for each in found.models:
        name = "exported" if Path(each.model) == model else "own friction" if each.friction else "as given"
        r2, velocity = each.median_r2(), [each.median_relative(k) for k in range(len(HORIZONS))]
        errors[name] = {"r2": r2 and rounded(r2), "velocity": [value and rounded(value) for value in velocity]}
    free = found.commanded
    positions = free and [rounded(1e3 * each) for each in (free.as_given, free.other, *(free.spread or ()))]
    own = {name: errors.get(name) for name in MODELS}
    return {"name": machine.name, "found in": source, **own, "positions": positions}


def tables(rows: list[Row]) -> list[str]:
    """Format the table."""
    own = "as given, its own friction, exported"
    head = f"robot, found in, replayed, R² {own}, 200 ms {own}, mrad as given, exported, logs vary by"
    cells = []
    for row in rows:
        models = [row[name] for name in MODELS]
        shown = [each and each["r2"] for each in models] + [each and each["velocity"][1] for each in models]
        numbers = ["" if value is None else f"{value:.3g}" for value in shown]
        free = [f"{each:.2g}" for each in row["positions"]] if row["positions"] else ["", ""]
        cells.append([row["name"], row["found in"], row["replayed"], *numbers, *free[:2], " to ".join(free[2:])])
    return [markdown_table(head.split(", "), cells, 3)]


if __name__ == "__main__":
    command(__doc__, [{"robot": robot, "replayed": log} for robot, log in RUNS], run, tables, of_estimates)
