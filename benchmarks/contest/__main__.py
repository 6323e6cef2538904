"""The public benchmark (README.md).

    python -m benchmarks.contest make FOLDER                        logs and truth, from a seed
    python -m benchmarks.contest run FOLDER --save benchmarks/contest/scores.json
    python -m benchmarks.contest table benchmarks/contest/scores.json          all tables

To run your own method: `python -m benchmarks.contest run FOLDER --entry "mine=python my_method.py"`.
"""

import argparse
import hashlib
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from benchmarks.contest.cases import ROBOTS
from benchmarks.contest.make import make
from benchmarks.contest.real import NO_LOGS, make_real
from benchmarks.contest.run import chosen, install, read_scores, run, write_scores
from benchmarks.contest.schema import SUMS, cases_of
from benchmarks.contest.score import Score
from benchmarks.contest.table import lines
from stribeck.core.errors import StribeckError


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return its exit code."""
    parser = argparse.ArgumentParser(
        prog="benchmarks.contest", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(required=True)
    making = commands.add_parser("make", help="make the logs")
    making.add_argument("folder", type=Path)
    making.add_argument("--robots", nargs="+", choices=ROBOTS, default=list(ROBOTS))
    making.set_defaults(act=_make)
    running = commands.add_parser("run", help="run contestants, and score them")
    running.add_argument("folder", type=Path)
    running.add_argument("--cases", nargs="+", help="only these, as robot/condition")
    running.add_argument("--contestants", nargs="+", help="only these")
    running.add_argument("--entry", action="append", default=[], help="another one, as NAME=COMMAND")
    running.add_argument("--jobs", type=int, default=1, help="how many run at once")
    running.add_argument("--save", type=Path, help="JSON that is read at first; runs that it holds are not repeated")
    running.set_defaults(act=_run)
    showing = commands.add_parser("table", help="print the table")
    showing.add_argument("scores", type=Path)
    showing.set_defaults(act=lambda given: print("\n".join(lines(read_scores(given.scores)))))
    commands.add_parser("install", help="install the environments of others").set_defaults(act=lambda _: install())
    given = parser.parse_args(arguments)
    try:
        given.act(given)
    except StribeckError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_code
    return 0


def _make(given: argparse.Namespace) -> None:
    make(given.folder, tuple(given.robots))
    data = os.environ.get("STRIBECK_REAL_LOGS")
    if data:
        make_real(given.folder, Path(data))
    else:
        print(NO_LOGS)


def _run(given: argparse.Namespace) -> None:
    entries = dict(entry.split("=", 1) for entry in given.entry)
    everyone = chosen([*given.contestants, *entries] if given.contestants else None, entries)
    scores = {
        (each.contestant, each.robot, each.condition): each for each in (read_scores(given.save) if given.save else [])
    }
    sums = hashlib.sha256((given.folder / SUMS).read_bytes()).hexdigest()
    left = [
        (name, command, case)
        for case in given.cases or cases_of(given.folder)
        for name, command in everyone.items()
        if (name, *case.split("/")) not in scores
    ]

    def one(job: tuple[str, Sequence[str] | str, str]) -> Score:
        name, command, case = job
        return run(name, command, given.folder, case)

    with ThreadPoolExecutor(given.jobs) as pool:
        for found in pool.map(one, left):
            scores[found.contestant, found.robot, found.condition] = found
            print(f"{found.contestant}, {found.robot}/{found.condition}: {found.blank or 'answered'}", flush=True)
            if given.save:
                write_scores(list(scores.values()), given.save, sums)
    if not given.save:
        print("\n".join(lines(list(scores.values()))))


if __name__ == "__main__":
    sys.exit(main())
