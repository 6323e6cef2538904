"""How much better the exported models explain logs of real robots that they were not found in.

    STRIBECK_REAL_LOGS=DATA_FOLDER python -m studies.replayed --save studies/replayed.json

Friction and corrections are found in a robot's first log, or in the first half of its only one, and exported as MJCF,
which has a place for rotors; the other logs, or the other half, are replayed. `--table` prints the table of a saved
study.
"""

import argparse
import json
import runpy
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from stribeck import Robot, export, identify
from stribeck.replay.replay import Replayed, replay
from stribeck.replay.rollouts import HORIZONS
from studies.real import DATA, EXAMPLES

ROBOTS = ("tx40", "go2", "double-pendulum", "kinova-gen3")
SHOWN = 1
"""Of the horizons, in the table."""
HEAD = """\
| robot | found in | replayed | R² as given | its own friction | exported | {0} as given | its own friction | exported |
|---|---|---|---:|---:|---:|---:|---:|---:|"""


def halves(log: Path) -> list[Path]:
    """Write both halves of a log beside it."""
    arrays = dict(np.load(log))
    samples = len(arrays["time"])
    written = []
    for name, rows in (("first half", slice(0, samples // 2)), ("second half", slice(samples // 2, samples))):
        written.append(log.parent / f"{name}.npz")
        np.savez(written[-1], **{key: value[rows] if len(value) == samples else value for key, value in arrays.items()})
    return written


def rows_of(folder: Path) -> Iterator[dict[str, Any]]:
    """Yield what is found of a robot, a row a log that is replayed."""
    logs = sorted(folder.glob("log*.npz"))
    first, *others = logs if len(logs) > 1 else halves(logs[0])
    robot = Robot.from_file(folder / "robot.toml")
    model = Path(robot.model_path)
    exported = folder / "exported.xml"
    export(identify(first, robot), robot, exported, "mjcf")
    for log in others:
        found = replay(log, robot, exported)
        errors = {(Path(each.model).name, each.friction): medians(each) for each in found.models}
        yield {
            "robot": robot.name,
            "found in": first.stem,
            "replayed": log.stem,
            "as given": errors[model.name, False],
            "own friction": errors.get((model.name, True)),
            "exported": errors[exported.name, True],
        }


def medians(model: Replayed) -> dict[str, Any]:
    """Return the medians over the joints."""
    relative = [model.median_relative(k) for k in range(len(HORIZONS))]
    return {"r2": _rounded(model.median_r2()), "velocity": [_rounded(value) for value in relative]}


def _rounded(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.3g}")


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Return the rows as Markdown."""
    lines = [HEAD.format(f"{1e3 * HORIZONS[SHOWN]:.0f} ms")]
    for row in rows:
        models = [row[key] for key in ("as given", "own friction", "exported")]
        cells = [row["robot"], row["found in"], row["replayed"]]
        cells += ["" if model is None else f"{model['r2']:.3g}" for model in models]
        cells += ["" if model is None else f"{model['velocity'][SHOWN]:.3g}" for model in models]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> None:
    """Run the study, or show a saved one."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--save", type=Path, help="write the figures here")
    parser.add_argument("--table", type=Path, help="show the table of these figures")
    chosen = parser.parse_args()
    if chosen.table:
        print(table(json.loads(chosen.table.read_text(encoding="utf-8"))))
        return
    if not DATA.is_dir():
        parser.error(f"{DATA} is no folder; set STRIBECK_REAL_LOGS to the folder of the published logs")
    convert = runpy.run_path(str(EXAMPLES / "convert.py"))["convert"]
    with tempfile.TemporaryDirectory() as scratch:
        rows = [row for robot in ROBOTS for row in rows_of(convert(robot, DATA, Path(scratch)))]
    print(table(rows))
    if chosen.save:
        chosen.save.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
