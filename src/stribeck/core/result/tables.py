"""Summaries of a result: table rows, notebook table, and next steps."""

import math
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import PurePath
from statistics import median, stdev

from stribeck.core.base.text_table import TextTable
from stribeck.core.result.estimates import CurvePoint
from stribeck.core.result.joint import JointResult
from stribeck.core.result.parts import Corrections

Joints = Mapping[str, JointResult]

MAIN = {"Coulomb": "coulomb", "viscous": "viscous", "rotor": "armature"}
"""Parameters in all summaries, by their title."""


def parameter_rows(joints: Joints) -> list[dict[str, object]]:
    """Build the rows of `Result.to_dataframe`: one per parameter, and one per joint without parameters."""
    rows: list[dict[str, object]] = []
    for name, joint in joints.items():
        ends = {"joint_verdict": joint.verdict}
        for parameter, estimate in joint.parameters.items():
            low, high = estimate.interval_95
            numbers = {"value": estimate.value, "standard_error": estimate.standard_error, "low": low, "high": high}
            row = {"joint": name, "parameter": parameter, **numbers, "unit": estimate.unit, "verdict": estimate.verdict}
            rows.append(row | ends)
        if not joint.parameters:
            rows.append({"joint": name, "parameter": None, "unit": None, "verdict": None, **ends})
    return rows


def joint_rows(joints: Joints) -> list[dict[str, object]]:
    """Build the rows of `Result.to_dataframe("joints")`."""
    rows: list[dict[str, object]] = []
    for name, joint in joints.items():
        row: dict[str, object] = {"joint": name, "verdict": joint.verdict, "reason": joint.reason}
        row |= {"next_step": advice(joint), "r2": joint.torque_r2.best if joint.torque_r2 else None}
        row["friction_r2"] = joint.friction_r2
        if joint.curve:
            middle = joint.curve[len(joint.curve) // 2]
            low, high = middle.interval_95
            row |= {"friction": middle.value, "low": low, "high": high, "unit": middle.unit}
            row["low_next_log"], row["high_next_log"] = middle.interval_next_log or (None, None)
            row["velocity"] = middle.velocity
        rows.append(row)
    return rows


def verdict_counts(joints: Joints) -> str:
    """Count the joints by verdict, e.g. "3 joints: 2 identified, 1 weak"."""
    counts = Counter(joint.verdict for joint in joints.values())
    said = ", ".join(f"{count} {verdict}" for verdict, count in counts.items())
    return f"{len(joints)} joint{'s' * (len(joints) != 1)}" + f": {said}" * bool(said)


def summary_rows(joints: Joints) -> list[tuple[str, ...]]:
    """List friction at middle speed, main parameters, verdict and next step of each joint."""
    rows: list[tuple[str, ...]] = []
    for name, joint in joints.items():
        numbers = zip(MAIN, main_parameters(joint), strict=True)
        said = ", ".join(f"{word} {value} {unit}" for word, (value, unit) in numbers if value)
        rows.append((name, friction_text(joint), said, joint.verdict, advice(joint)))
    return rows


def logs_text(changes: Corrections | None, names: Sequence[str]) -> str:
    """Describe how much the friction of several logs differs, and the log that differs most; "" for a single log."""
    if changes is None or not changes.log_offsets or len(names) < 2:
        return ""
    if not changes.log_friction:
        return f"no clear difference of friction between the {len(names)} logs"
    spreads = {joint: stdev(row) for joint, row in changes.log_friction.items()}
    widest = max(spreads, key=lambda joint: spreads[joint])
    odd = max(range(len(names)), key=lambda k: math.hypot(*(row[k] for row in changes.log_friction.values())))
    joint, odd_name = max(spreads, key=lambda joint: abs(changes.log_friction[joint][odd])), PurePath(names[odd]).name
    return (
        f"friction differs between the {len(names)} logs by {100 * median(spreads.values()):.2g} % (median standard "
        f"deviation of the joints; {widest} {100 * spreads[widest]:.2g} %), most in {odd_name} "
        f"({joint} {100 * changes.log_friction[joint][odd]:+.2g} %)"
    )


def main_parameters(joint: JointResult) -> list[tuple[str, str]]:
    """Format the `MAIN` parameters with half of their 95 % intervals, and their units; "?" marks weak ones.

    Friction that depends on the direction has the mean of both; texts of missing parameters are empty.
    """
    texts = []
    for name in MAIN.values():
        ways = [joint.parameters.get(name + way) for way in ("", "_positive", "_negative")]
        fits = [estimate for estimate in ways if estimate is not None] if joint.verdict != "no friction" else []
        if not fits:
            texts.append(("", ""))
            continue
        value, half = (sum(column) / len(fits) for column in zip(*((p.value, p.half_width) for p in fits), strict=True))
        weak = any(estimate.verdict == "weak" for estimate in fits)
        texts.append((with_error(value, half) + "?" * weak, fits[0].unit))
    return texts


def friction_text(joint: JointResult) -> str:
    """Format a joint's friction at middle speed with half of its 95 % interval, e.g. "14.1 ± 1.0 N m at 0.5 rad/s".

    For the verdict "no friction", the bound, e.g. "below 0.2 N m"; "" without a curve.
    """
    if not joint.curve:
        return ""
    if joint.verdict == "no friction":
        return bound_text(joint)
    middle = joint.curve[len(joint.curve) // 2]
    return f"{point_text(middle)} {middle.unit} at {middle.velocity:.2g} {joint.units()[0]}"


def with_error(value: float, error: float) -> str:
    """Format a value and its error with the digits of `rounded`: "1.183 ± 0.006"."""
    if not (1e-6 < error < 1e6 and abs(value) < 1e6):
        return f"{value:.4g} ± {error:.2g}"
    return " ± ".join(rounded(value, error))


def rounded(value: float, error: float) -> tuple[str, str]:
    """Round a value and its error for a table, e.g. `1.183`, `0.006`; an error that starts with 1 has two digits.

    Values have at most five digits; finer errors are rounded up.

    Parameters
    ----------
    value, error
        Numbers that need no exponent; the error is positive.
    """
    exponent = math.floor(math.log10(error))
    wanted = -exponent + (error < 1.95 * 10**exponent)
    most = 4 - math.floor(math.log10(max(abs(value), error)))
    decimals = max(min(wanted, most), 0)
    shown = round(error, decimals) if wanted <= most else math.ceil(error * 10**decimals) / 10**decimals
    text = f"{value:.{decimals}f}"
    return text if float(text) else text.lstrip("-"), f"{shown:.{decimals}f}"


def point_text(point: CurvePoint) -> str:
    """Format friction at a speed with half of its 95 % interval, or its bound if it is not significant."""
    if point.interval_95[0] <= 0:
        return f"< {point.interval_95[1]:.2g}"
    return with_error(point.value, point.half_width)


def result_table(title: str, joints: Joints) -> TextTable:
    """Build a table with one row per joint: parameters ± half of their intervals, verdict, reason and next step."""
    names = list(dict.fromkeys(name for joint in joints.values() for name in joint.parameters))
    rows = [
        [name, *(_cell(joint, parameter) for parameter in names), joint.verdict, main_reason(joint), advice(joint)]
        for name, joint in joints.items()
    ]
    return TextTable(title=title, left=["joint"], right=names, last=["verdict", "reason", "next step"], rows=rows)


def _cell(joint: JointResult, parameter: str) -> str:
    estimate = joint.parameters.get(parameter)
    if estimate is None:
        return ""
    unit = "" if estimate.unit == "1" else f" {estimate.unit}"
    return with_error(estimate.value, estimate.half_width) + unit + " (weak)" * (estimate.verdict == "weak")


def advice(joint: JointResult) -> str:
    """Recommend the next step for a joint, e.g. "record more motion near 5.7 rad/s"."""
    if joint.verdict == "not excited":
        return joint.remedy or "record faster and longer motion in both directions"
    if joint.verdict == "no friction":
        return f"none: {'friction is below the resolution of the log' if joint.curve else joint.reason}"
    if joint.verdict == "identified":
        loose = any(parameter.verdict != "identified" for parameter in joint.parameters.values())
        return "OK, use the curve" if loose else "OK"
    return _of_weak(joint)


def main_reason(joint: JointResult) -> str:
    """Return the main clause of a joint's reason, without the evidence."""
    return joint.main_reason or joint.reason


def bound_text(joint: JointResult) -> str:
    """Format the upper bound of the friction over all speeds: "below 0.02 N m"; empty without a curve."""
    return f"below {upper_bound(joint.curve):.2g} {joint.curve[0].unit}" if joint.curve else ""


def upper_bound(curve: Sequence[CurvePoint]) -> float:
    """Compute the upper bound of friction over all speeds [N m], [N]."""
    return max(point.interval_95[1] for point in curve)


def _of_weak(joint: JointResult) -> str:
    if joint.remedy:
        return joint.remedy
    if not joint.curve:
        return "record faster and longer motion"
    if not any(point.interval_95[0] > 0 for point in joint.curve):
        return "check the torque signal or record a longer log"
    if joint.friction_r2 is not None and joint.friction_r2 <= 0:
        return "check the model, signs and delays"
    return f"record more motion near {least_known(joint.curve).velocity:.2g} {joint.units()[0]}"


def least_known(curve: Sequence[CurvePoint]) -> CurvePoint:
    """Find the point with the widest interval relative to its value."""
    return max(curve, key=lambda point: point.half_width / max(point.value, sys.float_info.min))
