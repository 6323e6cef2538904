"""Run the studies: write numbers to JSON and figures to SVG, fill README.md, and print all numbers."""

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context

from studies.paper import figures, pages, walks
from studies.paper.study import NUMBERS, ROOT, find_studies, plain

QUICK = ROOT / "build" / "quick"
"""Folder that quick runs write to."""


def main(words: list[str]) -> None:
    studies = find_studies()
    parser = argparse.ArgumentParser(prog="python -m studies.paper", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="STUDY", help=", ".join(studies))
    parser.add_argument("--quick", action="store_true", help="short walks; everything is written under build/")
    arguments = parser.parse_args(words)
    if unknown := [name for name in arguments.names if name not in studies]:
        parser.error(f"there is no study '{unknown[0]}'; there are {', '.join(studies)}")
    chosen = arguments.names or list(studies)
    os.environ["OMP_NUM_THREADS"] = "1"  # two processes already use both cores
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        do_all(pool, make_walk, dict.fromkeys(walk for name in chosen for walk in studies[name].WALKS), arguments.quick)
        do_all(pool, run_study, chosen, arguments.quick)
    if not arguments.quick:
        pages.fill_page()
        pages.print_numbers()


def make_walk(name: str, quick: bool) -> None:
    """Simulate a walk that is not yet available."""
    walks.get_walk(name, quick)


def run_study(name: str, quick: bool) -> None:
    """Run a study and write its numbers and figures; a quick run writes to build/."""
    study = find_studies()[name]
    numbers = plain(study.run(quick))
    path = (QUICK if quick else NUMBERS) / f"{name}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")
    for figure, draw in getattr(study, "drawings", lambda _: {})(numbers).items():
        figures.save(figure, draw, QUICK if quick else figures.FOLDER)


def do_all(pool: ProcessPoolExecutor, task: Callable[[str, bool], object], names: Iterable[str], quick: bool) -> None:
    """Run a task for every name, two at a time, and print when each is done; the first error stops all tasks."""
    begun = time.perf_counter()
    futures = {pool.submit(task, name, quick): name for name in names}
    for future in as_completed(futures):
        future.result()
        print(f"{time.perf_counter() - begun:6.1f} s  {futures[future]}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
