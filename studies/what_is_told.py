"""What is said after the fit: each finding on logs that have its cause, and on logs that have another one.

    python -m studies.what_is_told --save studies/what_is_told.json

Walks of 32 s of a humanoid like TORO, on which the thresholds were chosen, and of the G1 and motions of 20 s of an arm,
on which they were not, are identified by default. `studies.told_cases` has what is wrong with each. Runs that are in
the saved file are not made again. `--only TORO-like` makes those of one robot, `--table` none.
"""

import argparse
import json
from collections.abc import Collection
from pathlib import Path
from typing import TypedDict

from stribeck import identify
from stribeck.identification.whole_log.tests_of_fit.findings import UNCLEAR
from stribeck.outputs import whole_or_not_at_all
from studies.told_cases import ENTIRE, IN_SOME, ON_THE_ARM, of_the_arm, of_walks

CHOSEN_ON, SHOWN_ON = ("TORO-like",), ("G1", "arm")
ARM_SEEDS = 2

CAUSES: dict[str, tuple[str, ...]] = {
    "passivity": ("sign",),
    "bodies-differ": ("payload",),
    "torque-delay": ("delay", "several"),
    "friction-load": ("load",),
    "friction-drift": ("drift",),
    "friction-presliding": ("presliding",),
    "friction-play": ("play",),
    "friction-delay": ("delay",),
    "friction-ripple": ("ripple", "several"),
    UNCLEAR: ("load", "drift", "presliding", "play", "delay", "ripple", "several"),
    "much-set-aside": ("pushed", "presliding"),
    "heterogeneity": ("pushed", "several"),
}
"""Which causes each check is right about."""

MISSES = {"torque-delay": ("one torque 5 ms late",), "friction-delay": ("torques 2 ms late", "all torques 4 ms late")}
"""Cases that have a cause but are another check's: they count neither way."""


class Told(TypedDict):
    """What was said of a log: checks, the joints that each names, and the lines of the result."""

    robot: str
    case: str
    seed: int
    cause: str
    having: list[str]
    said: dict[str, list[str]]
    warnings: list[str]


def tell(robot: str, case: str, seed: int) -> Told:
    """Return what is said of a log."""
    cause, joints, machine, logs = of_the_arm(case, seed) if robot == "arm" else of_walks(robot, case, seed)
    result = identify(logs, machine)
    return Told(
        robot=robot,
        case=case,
        seed=seed,
        cause=cause,
        having=list(joints),
        said={finding.check: list(finding.joints) for finding in result.findings},
        warnings=result.warnings,
    )


def rates(told: Collection[Told], check: str) -> tuple[int, int, int, int]:
    """Return on how many logs with its cause a check says something, of how many, and the same without."""
    hit = having = false = others = 0
    for one in told:
        if one["case"] in MISSES.get(check, ()):
            continue
        there = one["cause"] in CAUSES[check]
        having, hit = having + there, hit + (there and check in one["said"])
        others, false = others + (not there), false + (not there and check in one["said"])
    return hit, having, false, others


def table(told: Collection[Told]) -> list[str]:
    """Return the rows of the table in docs/findings.md."""
    rows = []
    for check in CAUSES:
        cells = []
        for robots in (CHOSEN_ON, SHOWN_ON):
            hit, having, false, others = rates([one for one in told if one["robot"] in robots], check)
            shown = having and check != UNCLEAR  # where a kind alone is named, that is better
            cells += [f"{hit} of {having}" if shown else "–", f"{false} of {others}"]
        rows.append(f"| `{check}` | {' | '.join(cells)} |")
    return rows


HEAD = "| check | with its cause | without | with its cause | without |\n|---|---:|---:|---:|---:|"


def runs(robots: Collection[str]) -> list[tuple[str, str, int]]:
    """Return robot, case and seed of all runs."""
    found = [(robot, case, 0) for robot in (*CHOSEN_ON, *SHOWN_ON) if robot != "arm" for case in (*ENTIRE, *IN_SOME)]
    found += [("arm", case, seed) for seed in range(ARM_SEEDS) for case in ON_THE_ARM]
    return [run for run in found if run[0] in robots]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="*", default=[*CHOSEN_ON, *SHOWN_ON], help="robots")
    parser.add_argument("--save", type=Path, help="read from, and write to after every run")
    parser.add_argument("--table", action="store_true", help="make no runs")
    arguments = parser.parse_args()
    there = arguments.save and arguments.save.exists()
    told: list[Told] = json.loads(arguments.save.read_text(encoding="utf-8"))["told"] if there else []
    done = {(one["robot"], one["case"], one["seed"]) for one in told}
    for run in [] if arguments.table else runs(arguments.only):
        if run in done:
            continue
        told.append(tell(*run))
        print(*run, *told[-1]["warnings"], sep="\n  ", flush=True)
        if arguments.save:
            with whole_or_not_at_all(arguments.save) as temporary:
                temporary.write_text(json.dumps({"told": told}, indent=1) + "\n", encoding="utf-8")
    print(HEAD, *table(told), sep="\n")


if __name__ == "__main__":
    main()
