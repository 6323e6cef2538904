"""Measure whether verdicts mark wrong values as weak, on straight walks with known friction.

    python -m studies.verdicts --save studies/verdicts.json

The logs are the straight walks of `studies.accuracy`, about 45 s each, with its noise and wrong models. They are too
short for some of the six parameters of some joints. A parameter or curve with an error above 25 % should be weak
(recall), and should not be weak with an error below 10 % (false alarms). Errors of offsets are relative to the Coulomb
friction if it is larger than the offset, as in their verdicts. The error of a curve, like its width, is the root mean
square over its three speeds. The table contains today's verdicts, and alternative limits of the relative half width of
the 95 % interval; `WIDEST` in `judgement/curve.py` was chosen from it.
"""

from collections.abc import Iterable, Iterator
from itertools import product

import numpy as np

from stribeck import Settings, identify
from stribeck.friction import get_law
from stribeck.judgement.curve import relative_width
from stribeck.result import JointResult
from studies.accuracy import walks_of
from studies.accuracy_cases import CASES, LAW, NAMES, WALKS, measured, wrong_model
from studies.command import Row, command, rounded
from studies.markdown import markdown_table

WRONG, RIGHT = 0.25, 0.10
"""Relative errors [1] above which a value should be weak, and below which it should not."""
WIDTHS = (0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5)
NOISY = ("A", "B", "A, wrong model", "B, wrong model")
METHODS = {"whole-log": Settings(law=LAW, corrections="inertia"), "curve-fit": Settings(law=LAW, method="curve-fit")}
CURVE = "curve"
"""Name of a joint's friction curve among its parameters."""
HEAD = ("of", "method", "weak from", "over 25 % wrong", "flagged", "within 10 %", "called weak")


def run(robot: str, case: str, method: str, seed: int) -> Row:
    """Judge every parameter that has a number, and every curve: relative error, relative half width, whether weak."""
    walk = walks_of(robot, False)[0]
    believed = wrong_model(walk.robot, seed) if CASES[case].wrong_model else walk.robot
    result = identify([measured(walk.log, CASES[case], seed, 0)], believed, METHODS[method])
    judged = [
        {"joint": joint, "parameter": name, "error": rounded(error, 4), "width": rounded(width, 4), "weak": weak}
        for joint, known in walk.truth.parameters.items()
        for name, error, width, weak in _of_joint(result.joints[joint], known)
    ]
    return {"judged": judged}


def _of_joint(joint: JointResult, known: dict[str, float]) -> Iterator[tuple[str, float, float, bool]]:
    """Yield the name, error, half width and weakness of each parameter and of the curve."""
    for name in NAMES if len(joint.parameters) >= len(NAMES) else ():
        estimate = joint.parameters[name]
        value, true = abs(estimate.value), abs(known[name])
        if name == "offset":
            value, true = max(value, joint.parameters["coulomb"].value), max(true, known["coulomb"])
        half = (estimate.interval_95[1] - estimate.interval_95[0]) / 2
        yield name, abs(estimate.value - known[name]) / true, half / max(value, 1e-9), estimate.verdict == "weak"
    if joint.curve:
        speeds = np.array([point.velocity for point in joint.curve])
        values = np.array([known[name] for name in NAMES])
        true_curve = (get_law(LAW).torque(speeds, values) - get_law(LAW).torque(-speeds, values)) / 2
        off = np.array([point.value for point in joint.curve]) - true_curve
        error = float(np.linalg.norm(off) / np.linalg.norm(true_curve))
        yield CURVE, error, relative_width(joint.curve), joint.verdict != "identified"


def flagged(judged: Iterable[Row], width: float | None = None) -> tuple[int, int, int, int]:
    """Count wrong values, weak values among them, right values, and weak values among them."""
    weak = [(each["error"], each["weak"] if width is None else each["width"] > width) for each in judged]
    wrong, right = [w for error, w in weak if error > WRONG], [w for error, w in weak if error < RIGHT]
    return len(wrong), sum(wrong), len(right), sum(right)


def tables(rows: list[Row]) -> list[str]:
    """Format the table of parameters and curves per method: today's verdicts, then alternative widths."""
    cells = []
    for kind, method in product(("parameters", "curves"), METHODS):
        judged = [each for row in rows if row["method"] == method for each in row["judged"]]
        own = [each for each in judged if (each["parameter"] == CURVE) == (kind == "curves")]
        for width in (None, *WIDTHS):
            wrong, found, right, alarms = flagged(own, width)
            shares = [f"{part / whole:.1%}" if whole else "–" for part, whole in ((found, wrong), (alarms, right))]
            shown = "as it is" if width is None else f"± {100 * width:g} %"
            cells.append((kind, method, shown, wrong, shares[0], right, shares[1]))
    return [markdown_table(HEAD, cells, 3)]


if __name__ == "__main__":
    keys = [
        {"robot": robot, "case": case, "method": method, "seed": 0}
        for robot, case, method in product(WALKS, NOISY, METHODS)
    ]
    command(__doc__, keys, run, tables)
