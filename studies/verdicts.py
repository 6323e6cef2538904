"""Whether verdicts tell what is wrong, on straight walks, whose friction is known.

    python -m studies.verdicts --save studies/verdicts.json

The straight walks of `studies.accuracy`, about 45 s each, with its noise and wrong models: too little for some of the
six parameters of some joints. What is over 25 % wrong, a parameter or a joint's friction curve, should be called weak
(recall), what is within 10 % should not (false alarms). Errors of offsets are relative to the Coulomb friction where
that is larger, as their verdicts are; that of a curve is the root mean square over its three speeds, as its width is.
Printed for the verdicts as they are, and for half widths of the 95 % interval, relative to the value, from which all
could be called weak; `WIDEST` in `identification/judgement/curve.py` was chosen from this.

Runs that the file holds already are not repeated: move it away when the estimator has changed.
"""

import argparse
import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TypedDict

import numpy as np

from stribeck import Settings, identify
from stribeck.friction import get_law
from stribeck.identification.judgement.curve import relative_width
from stribeck.result import JointResult
from stribeck_simulation.run import Simulated
from studies.accuracy_cases import CASES, LAW, NAMES, ROBOTS, exact_walks, measured, wrong_model

SEEDS = 1
WRONG, RIGHT = 0.25, 0.10
"""Relative errors [1] from which something should be called weak, and up to which it should not."""
WIDTHS = (0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5)
NOISY = ("A", "B", "A, wrong model", "B, wrong model")
METHODS = {"whole-log": {"corrections": "inertia"}, "curve-fit": {}}
CURVE = "curve"
"""Name of a joint's friction curve among its parameters."""
HEAD = (
    "| of | method | weak from | over 25 % wrong | flagged | within 10 % | called weak |\n"
    "|---|---|---:|---:|---:|---:|---:|"
)
DIGITS = 4


class Said(TypedDict):
    """Of a parameter or a curve: its relative error, half of its interval over its value, whether it is called weak."""

    method: str
    robot: str
    case: str
    seed: int
    joint: str
    parameter: str
    error: float
    width: float
    weak: bool


def said_of(method: str, robot: str, case: str, seed: int, walk: Simulated) -> list[Said]:
    """Return what a method says of every parameter that got a number, and of every curve."""
    believed = wrong_model(walk.robot, seed) if CASES[case].wrong_model else walk.robot
    settings = Settings.model_validate({"law": LAW, "method": method, **METHODS[method]})
    result = identify([measured(walk.log, CASES[case], seed, 0)], believed, settings)
    return [
        Said(
            method=method,
            robot=robot,
            case=case,
            seed=seed,
            joint=joint,
            parameter=name,
            error=float(f"{error:.{DIGITS}g}"),
            width=float(f"{width:.{DIGITS}g}"),
            weak=weak,
        )
        for joint, known in walk.truth.parameters.items()
        for name, error, width, weak in _said_of_joint(result.joints[joint], known)
    ]


def _said_of_joint(joint: JointResult, known: dict[str, float]) -> Iterator[tuple[str, float, float, bool]]:
    """Yield name, error, half width and whether it is weak, of each parameter and of the curve."""
    for name in NAMES if len(joint.parameters) >= len(NAMES) else ():
        estimate = joint.parameters[name]
        value, true = abs(estimate.value), abs(known[name])
        if name == "offset":
            value, true = max(value, joint.parameters["coulomb"].value), max(true, known["coulomb"])
        low, high = estimate.interval_95
        yield (
            name,
            abs(estimate.value - known[name]) / true,
            (high - low) / 2 / max(value, 1e-9),
            estimate.verdict == "weak",
        )
    if joint.curve:
        speeds = np.array([point.velocity for point in joint.curve])
        values = np.array([known[name] for name in NAMES])
        true_curve = (get_law(LAW).torque(speeds, values) - get_law(LAW).torque(-speeds, values)) / 2
        off = np.array([point.value for point in joint.curve]) - true_curve
        error = float(np.linalg.norm(off) / np.linalg.norm(true_curve))
        yield CURVE, error, relative_width(joint.curve), joint.verdict != "identified"


def flagged(said: Iterable[Said], width: float | None = None) -> tuple[int, int, int, int]:
    """Return how many are wrong, how many of them are weak, how many right, how many of them weak."""
    said = list(said)
    weak = [each["weak"] if width is None else each["width"] > width for each in said]
    wrong = [called for each, called in zip(said, weak, strict=True) if each["error"] > WRONG]
    right = [called for each, called in zip(said, weak, strict=True) if each["error"] < RIGHT]
    return len(wrong), sum(wrong), len(right), sum(right)


def table(said: list[Said]) -> list[str]:
    """Return the rows: for parameters and for curves, and each method, as verdicts are, then by width."""
    lines = []
    for kind in ("parameters", "curves"):
        for method in METHODS:
            own = [
                each for each in said if each["method"] == method and (each["parameter"] == CURVE) == (kind == "curves")
            ]
            for width in (None, *WIDTHS):
                wrong, found, right, alarms = flagged(own, width)
                shown = "as it is" if width is None else f"± {100 * width:g} %"
                shares = [f"{part / whole:.1%}" if whole else "–" for part, whole in ((found, wrong), (alarms, right))]
                lines.append(f"| {kind} | {method} | {shown} | {wrong} | {shares[0]} | {right} | {shares[1]} |")
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--robots", nargs="+", default=list(ROBOTS), choices=ROBOTS, help="only these")
    parser.add_argument("--save", type=Path, help="JSON that is read at first, and written after every run")
    arguments = parser.parse_args()
    said: list[Said] = []
    if arguments.save and arguments.save.exists():
        said = json.loads(arguments.save.read_text(encoding="utf-8"))["parameters"]

    def save() -> None:
        if arguments.save:
            rows = ",\n".join(json.dumps(each) for each in said)
            arguments.save.write_text(f'{{"parameters": [\n{rows}\n]}}\n', encoding="utf-8")

    done = {(each["method"], each["robot"], each["case"], each["seed"]) for each in said}
    for robot in arguments.robots:
        runs = [(method, robot, case, seed) for case in NOISY for seed in range(arguments.seeds) for method in METHODS]
        if set(runs) <= done:
            continue
        walk = exact_walks(robot)[0]
        for run in runs:
            if run not in done:
                said += (found := said_of(*run, walk))
                print(*run, flagged(found), flush=True)
                save()
    print(HEAD, *table(said), sep="\n")
    for each in said:
        if each["error"] > WRONG and not each["weak"]:
            print("not flagged:", *each.values())


if __name__ == "__main__":
    main()
