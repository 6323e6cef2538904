"""The command line that all studies share: compute missing runs, save them as JSON, print the tables.

A study consists of a list of runs, each identified by a few keys; a function that computes the row of a run from its
keys; and a function that formats all rows as Markdown tables. Runs that are already in the file are not repeated: move
the file away after a change of the estimator.
"""

import argparse
import json
import os
import runpy
import sys
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
Row = dict[str, Any]
"""Keys and numbers of one run, as in a JSON file."""


def command(
    description: str | None,
    runs: Iterable[Row],
    run: Callable[..., Row],
    tables: Callable[[list[Row]], list[str]],
) -> None:
    """Run a study from the command line.

    Parameters
    ----------
    description
        Docstring of the study.
    runs
        Keys of all runs.
    run
        Computes the other columns of a row, given its keys as arguments.
    tables
        Formats all rows as Markdown tables.
    """
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--save", type=Path, metavar="FILE", help="JSON that is read first and written after every run")
    parser.add_argument("--only", nargs="+", default=[], metavar="KEY", help="only the runs that have all these keys")
    options = parser.parse_args()
    rows = read_rows(options.save) if options.save else []
    for keys in runs:
        known = any(keys.items() <= row.items() for row in rows)
        if known or not set(options.only) <= {str(value) for value in keys.values()}:
            continue
        rows.append({**keys, **run(**keys)})
        print(*keys.values(), "done", file=sys.stderr, flush=True)
        if options.save:
            lines = ",\n".join(json.dumps(row) for row in rows)
            options.save.write_text(f'{{"rows": [\n{lines}\n]}}\n', encoding="utf-8")
    print(*tables(rows), sep="\n\n")


def read_rows(path: Path) -> list[Row]:
    """Read the rows of a study; an empty list if the file does not exist."""
    rows: list[Row] = json.loads(path.read_text(encoding="utf-8"))["rows"] if path.exists() else []
    return rows


def saved(study: str) -> list[Row]:
    """Read the committed rows of a study by its name."""
    return read_rows(ROOT / "studies" / f"{study}.json")


def rounded(value: float, digits: int = 3) -> float:
    """Round to significant digits."""
    return float(f"{value:.{digits}g}")


@cache
def real_robot(name: str) -> Path:
    """Convert a real robot's published logs to a folder with robot.toml, curve-fit.toml, the model and log*.npz."""
    data = os.environ.get("STRIBECK_REAL_LOGS")
    if not data:
        sys.exit("the published logs of real robots are not part of this repository: set STRIBECK_REAL_LOGS to them")
    convert = runpy.run_path(str(ROOT / "examples" / "real_robots" / "convert.py"))["convert"]
    folder: Path = convert(name, Path(data), ROOT / "build" / "real-logs")
    return folder
