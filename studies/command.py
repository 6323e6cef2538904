"""The command line that all studies share: compute missing runs, save them as JSON, print the tables.

A study consists of a list of runs, each identified by a few keys; a function that computes the row of a run from its
keys; and a function that formats all rows as Markdown tables. The file has a stamp: date and version, the number of all
runs, and a digest of what its numbers depend on. While the digest is the same, only missing runs are computed;
otherwise the study starts anew.
"""

import argparse
import ast
import hashlib
import json
import os
import runpy
import sys
from collections.abc import Callable, Iterable
from datetime import date
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from stribeck.core.base.outputs import whole_or_not_at_all

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "stribeck"
REAL = dict.fromkeys(("kuka-lwr4", "kinova-gen3", "double-pendulum"), "log_1") | {
    "tx40": "log",
    "go2-ten-logs": "log_0",
}
"""Log of each real robot whose numbers are frozen."""
Row = dict[str, Any]
"""Keys and numbers of one run, as in a JSON file."""


def of_estimates(*without: str) -> str:
    """Compute the digest of studies that estimate friction: that of the frozen numbers, which refactoring keeps."""
    frozen = json.loads((ROOT / "tests" / "golden.json").read_bytes())
    kept = {case: _without_words(numbers) for case, numbers in frozen.items() if case not in without}
    return hashlib.sha256(json.dumps(kept).encode()).hexdigest()[:12]


def of_simulated() -> str:
    """Compute the digest of studies that estimate friction from simulated logs only."""
    return of_estimates(*REAL)


def _without_words(node: Any) -> Any:
    """Replace all texts by "": a finding in other words changes no figure."""
    if isinstance(node, dict):
        return {key: _without_words(value) for key, value in node.items()}
    return (
        [_without_words(value) for value in node] if isinstance(node, list) else "" if isinstance(node, str) else node
    )


@cache
def of_code(*folders: str) -> str:
    """Compute the digest of packages of stribeck: code without comments and docstrings, and models."""
    found = hashlib.sha256()
    for path in sorted(path for folder in folders for path in (SOURCE / folder).rglob("*.*")):
        if path.suffix == ".py":
            tree = _WithoutDocstrings().visit(ast.parse(path.read_text(encoding="utf-8")))
            found.update(ast.dump(tree).encode())
        elif path.suffix in (".xml", ".urdf", ".toml"):
            found.update(path.read_bytes())
    return found.hexdigest()[:12]


class _WithoutDocstrings(ast.NodeTransformer):
    def visit_Expr(self, node: ast.Expr) -> ast.Expr | None:
        return None if isinstance(node.value, ast.Constant) else node


def command(
    description: str | None,
    runs: Iterable[Row],
    run: Callable[..., Row],
    tables: Callable[[list[Row]], list[str]],
    digest: Callable[[], str] = of_simulated,
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
    digest
        Computes the digest of what the numbers depend on.
    """
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--save", type=Path, metavar="FILE", help="JSON that is read first and written after every run")
    parser.add_argument("--only", nargs="+", default=[], metavar="KEY", help="only the runs that have all these keys")
    options = parser.parse_args()
    every, now, rows = list(runs), digest(), list[Row]()
    if options.save and options.save.exists():
        before = read(options.save)
        if before["digest"] == now:
            rows = before["rows"]
        else:
            print(f"starts anew: numbers may have changed since {before['date']}", file=sys.stderr)
    for keys in every:
        known = any(keys.items() <= row.items() for row in rows)
        if known or not set(options.only) <= {str(value) for value in keys.values()}:
            continue
        rows.append(shortened({**keys, **run(**keys)}))
        print(*keys.values(), "done", file=sys.stderr, flush=True)
        if options.save:
            stamp = {"date": str(date.today()), "version": version("stribeck"), "digest": now, "runs": len(every)}
            write(options.save, stamp, rows)
    print(*tables(rows), sep="\n\n")


def read(path: Path) -> Row:
    """Read a study: date, version, digest, number of runs, and rows."""
    study: Row = json.loads(path.read_text(encoding="utf-8"))
    return study


def write(path: Path, stamp: Row, rows: list[Row]) -> None:
    """Write a study, one row per line."""
    lines = ",\n".join(json.dumps(row) for row in rows)
    with whole_or_not_at_all(path) as temporary:
        temporary.write_text(f'{json.dumps(stamp)[:-1]}, "rows": [\n{lines}\n]}}\n', encoding="utf-8")


def saved(study: str) -> list[Row]:
    """Read the committed rows of a study by its name."""
    rows: list[Row] = read(ROOT / "studies" / f"{study}.json")["rows"]
    return rows


def shortened(row: Row) -> Row:
    """Round all numbers of a row to four significant digits."""
    short: Row = json.loads(json.dumps(row), parse_float=lambda text: rounded(float(text), 4))
    return short


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
