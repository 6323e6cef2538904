"""Harder conditions, side by side: the paper's method, the whole log with the law known, and the default.

    python -m studies.harder --save studies/harder.json

The conditions are those of `studies.harder_cases`, on walks that nothing was tuned on, of two robots and one seed. Each
row: Coulomb friction, mean and worst joint, and the shape of the curve [%]; and the coverage of the 95 % intervals of
parameters that are not called weak. Runs that the file holds already are not repeated: move it away when the estimator
has changed.
"""

import argparse
from itertools import product
from pathlib import Path

import numpy as np

from studies.ablation import FULL, MEASURES, coverage, read, run, write
from studies.accuracy_table import CURVE_FIT, DEFAULT, Key, Run
from studies.harder_cases import CONDITIONS

ROBOTS = ("TORO-like", "G1")
ESTIMATORS = {CURVE_FIT: "curve-fit", FULL: "law known", DEFAULT: "default"}
HEAD = f"| condition | robot | {' | '.join(ESTIMATORS.values())} |\n|---|---|{'---:|' * len(ESTIMATORS)}"


def table(runs: dict[Key, Run]) -> list[str]:
    """Return a row for each condition and robot that all estimators have run."""
    rows = []
    for condition, robot in product(CONDITIONS, ROBOTS):
        found = [runs.get((robot, condition, method, 0)) for method in ESTIMATORS]
        if all(found):
            rows.append(f"| {condition} | {robot} | {' | '.join(_cell(one) for one in found if one)} |")
    return rows


def _cell(one: Run) -> str:
    mean, worst, shape = (100 * MEASURES[name](one) for name in ("Coulomb", "worst joint", "shape"))
    share = coverage([one])
    held = "–" if np.isnan(share) else f"{100 * share:.0f} %"
    return f"{mean:.1f} / {worst:.1f}, {shape:.1f}, {held}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--save", type=Path, help="JSON that is read at first, and written after every run")
    arguments = parser.parse_args()
    runs, held = read(arguments.save) if arguments.save else ({}, {})
    for robot, condition, method in product(ROBOTS, CONDITIONS, ESTIMATORS):
        key = (robot, condition, method, 0)
        if key not in runs:
            runs[key] = run(key)
            if arguments.save:
                write(arguments.save, runs, held)
    print(HEAD, *table(runs), sep="\n")


if __name__ == "__main__":
    main()
