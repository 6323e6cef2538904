"""Whether verdicts tell what is wrong: straight walking alone, and every parameter's error beside its verdict.

    python -m studies.verdicts --save studies/verdicts.json

The straight walks of `studies.accuracy`, about 45 s each, with its noise and wrong models: too little for some of the
six parameters of some joints. A parameter that is over 25 % wrong should be called weak (recall), one that is within
10 % should not (false alarms). Errors of offsets are relative to the Coulomb friction where that is larger, as their
verdicts are. Printed for the verdicts as they are, and for widths of the 95 % interval, relative to the value, from
which all parameters could be called weak; `CRITERIA` in `methods/whole_log.py` was chosen from this.

Runs that the file holds already are not repeated: move it away when the estimator has changed.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable
from pathlib import Path
from typing import TypedDict

from stribeck import Settings, identify
from stribeck_simulation.run import Simulated
from studies.accuracy_cases import CASES, LAW, NAMES, ROBOTS, exact_walks, measured, wrong_model

SEEDS = 5
WRONG, RIGHT = 0.25, 0.10
"""Relative errors [1] from which a parameter should be called weak, and up to which it should not."""
WIDTHS = (0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.6, 0.8, 1.0)
NOISY = ("A", "B", "A, wrong model", "B, wrong model")
HEAD = "| robot | weak from | over 25 % wrong | flagged | within 10 % | called weak |\n|---|---:|---:|---:|---:|---:|"
DIGITS = 6


class Said(TypedDict):
    """Of one parameter: its relative error, the width of its interval over its value, and whether it is called weak."""

    robot: str
    case: str
    seed: int
    joint: str
    parameter: str
    error: float
    width: float
    weak: bool


def said_of(robot: str, case: str, seed: int, walk: Simulated) -> list[Said]:
    """Return what the whole log says of every parameter that got a number."""
    believed = wrong_model(walk.robot, seed) if CASES[case].wrong_model else walk.robot
    settings = Settings(law=LAW, method="whole-log", corrections="inertia")
    result = identify([measured(walk.log, CASES[case], seed, 0)], believed, settings)
    found: list[Said] = []
    for joint, known in walk.truth.parameters.items():
        parameters = result.joints[joint].parameters
        for name in NAMES if parameters else ():
            estimate = parameters[name]
            value, true = abs(estimate.value), abs(known[name])
            if name == "offset":
                value, true = max(value, parameters["coulomb"].value), max(true, known["coulomb"])
            low, high = estimate.interval_95
            found.append(
                Said(
                    robot=robot,
                    case=case,
                    seed=seed,
                    joint=joint,
                    parameter=name,
                    error=float(f"{abs(estimate.value - known[name]) / true:.{DIGITS}g}"),
                    width=float(f"{(high - low) / max(value, 1e-9):.{DIGITS}g}"),
                    weak=estimate.verdict == "weak",
                )
            )
    return found


def flagged(said: Iterable[Said], width: float | None = None) -> tuple[int, int, int, int]:
    """Return how many parameters are wrong, how many of them are weak, how many right, how many of them weak."""
    said = list(said)
    weak = [each["weak"] if width is None else each["width"] > width for each in said]
    wrong = [called for each, called in zip(said, weak, strict=True) if each["error"] > WRONG]
    right = [called for each, called in zip(said, weak, strict=True) if each["error"] < RIGHT]
    return len(wrong), sum(wrong), len(right), sum(right)


def table(said: list[Said]) -> list[str]:
    """Return a line for each robot as verdicts are, then for all of them by width."""
    lines = []
    for robot in ROBOTS:
        if own := [each for each in said if each["robot"] == robot]:
            lines.append(_line(robot, "as it is", flagged(own)))
    lines.append(_line("all", "as it is", flagged(said)))
    return lines + [_line("all", f"{width:g}", flagged(said, width)) for width in WIDTHS]


def _line(robot: str, width: str, numbers: tuple[int, int, int, int]) -> str:
    wrong, found, right, alarms = numbers
    return f"| {robot} | {width} | {wrong} | {found / max(wrong, 1):.1%} | {right} | {alarms / max(right, 1):.1%} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--robots", nargs="+", default=list(ROBOTS), choices=ROBOTS, help="only these")
    parser.add_argument("--save", type=Path, help="JSON that is read at first, and written after every run")
    arguments = parser.parse_args()
    said: list[Said] = []
    if arguments.save and arguments.save.exists():
        said = json.loads(arguments.save.read_text(encoding="utf-8"))["parameters"]
    done = {(each["robot"], each["case"], each["seed"]) for each in said}
    for robot in arguments.robots:
        runs = [(robot, case, seed) for case in NOISY for seed in range(arguments.seeds)]
        if set(runs) <= done:
            continue
        walk = exact_walks(robot)[0]
        for run in runs:
            if run not in done:
                said += said_of(*run, walk)
                print(*run, flagged(said[-len(walk.truth.parameters) * len(NAMES) :]), flush=True)
                if arguments.save:
                    lines = ",\n".join(json.dumps(each) for each in said)
                    arguments.save.write_text(f'{{"parameters": [\n{lines}\n]}}\n', encoding="utf-8")
    print(HEAD, *table(said), sep="\n")
    for each in said:
        if each["error"] > WRONG and not each["weak"]:
            print("not flagged:", *each.values())


if __name__ == "__main__":
    main()
