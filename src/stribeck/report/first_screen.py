"""The first screen: every joint's friction curve, one line a joint, and what to do about it."""

from typing import Any

from stribeck.friction.law import FrictionLaw
from stribeck.report.curves import FrictionCurve, curve_figures, friction_curve, script_data
from stribeck.report.page import Section, render
from stribeck.report.text import brief, number
from stribeck.report.warnings import flagged_joints, warnings
from stribeck.result import CurvePoint, Evidence, JointResult, Result
from stribeck.result.advice import advice

ORDER = {"identified": 0, "weak": 1, "not excited": 2}
"""Of verdicts, for sorting."""


LONGEST_NAME = 24
"""Letters of a joint's name that have room in one line; a longer one is broken, never cut."""


def first_screen(result: Result, evidence: Evidence, law: FrictionLaw) -> Section:
    """Return the section with the curves, the lines of all joints, those without friction in one, and the warnings."""
    curves: dict[str, FrictionCurve] = {}
    for name, joint in result.joints.items():
        curve = friction_curve(name, joint, evidence, law)
        if curve is not None:
            curves[name] = curve
    flagged = flagged_joints(result)
    figures = curve_figures(result, curves)
    rows = [
        _row(f"joint-{index}", index, name, joint, flagged=name in flagged)
        for index, (name, joint) in enumerate(result.joints.items())
        if joint.verdict != "no friction"
    ]
    without = [
        {"anchor": f"joint-{index}", "name": name, "bound": _bound(joint)}
        for index, (name, joint) in enumerate(result.joints.items())
        if joint.verdict == "no friction"
    ]
    bounds = [found for joint in result.joints.values() if joint.verdict == "no friction" and (found := _bounds(joint))]
    body = render(
        "first_screen.html.j2",
        figures=figures,
        data=script_data(figures),
        rows=rows,
        without=without,
        warnings=warnings(result),
        most=max(bounds, default=None, key=lambda bound: bound[0]),
        unit=_common([row["unit"] for row in rows if row["unit"]]),
        units=("m/s", "N") if all(curve.prismatic for curve in curves.values()) else ("rad/s", "N m"),
        longest=LONGEST_NAME,
        compared=any(row["r2"] is not None for row in rows),
        total=len(rows) + len(without),
    )
    return Section(anchor="friction", title="Friction of every joint", body=body)


def _row(anchor: str, index: int, name: str, joint: JointResult, *, flagged: bool) -> dict[str, Any]:
    speeds = [_cell(point) for point in joint.curve]
    return {
        "anchor": anchor,
        "index": index,
        "name": name,
        "verdict": joint.verdict,
        "order": ORDER.get(joint.verdict, len(ORDER)),
        "reason": joint.reason,
        "speeds": speeds if len(speeds) == 3 else [None] * 3,
        "unit": joint.curve[0].unit if joint.curve else "",
        "r2": joint.torque_r2,
        "advice": advice(joint),
        "flagged": flagged,
    }


def _cell(point: CurvePoint) -> dict[str, Any]:
    """Return the friction at a speed as text, where it is not significant its bound, and as a number to sort by."""
    significant = point.interval_95[0] > 0
    value, error = brief(point.value, point.half_width)
    return {
        "value": value if significant else f"< {number(point.interval_95[1], 2)}",
        "error": error if significant else "",
        "velocity": number(point.velocity, 2),
        "speed_unit": "rad/s" if point.unit == "N m" else "m/s",
        "sort": f"{point.value:.6g}",
    }


def _bounds(joint: JointResult) -> tuple[float, str] | None:
    """Return what the friction of a joint stays below, and its unit."""
    if not joint.curve:
        return None
    return max(point.interval_95[1] for point in joint.curve), joint.curve[0].unit


def _bound(joint: JointResult) -> str:
    bound = _bounds(joint)
    return f"below {number(bound[0], 2)} {bound[1]}" if bound else joint.reason


def _common(units: list[str]) -> str:
    """Return the unit that all have, "" if they differ."""
    return units[0] if units and len(set(units)) == 1 else ""
