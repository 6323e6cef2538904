"""First screen of the report: results, trust, next steps, and one line per joint."""

from collections.abc import Sequence
from pathlib import PurePath
from statistics import median
from typing import Any

import numpy as np
from markupsafe import Markup

from stribeck.base.finding import Finding
from stribeck.friction.law import FrictionLaw
from stribeck.report.curves import curve_charts, friction_curve
from stribeck.report.joints import joint_samples
from stribeck.report.page import Section, render
from stribeck.report.reference import NO_REFERENCE, Reference
from stribeck.report.text import brief, number
from stribeck.result import CurvePoint, Evidence, JointResult, Result, Verdict
from stribeck.result.tables import advice, coulomb_and_viscous, logs_text

VERDICTS: tuple[Verdict, ...] = ("identified", "weak", "not excited", "no friction")
"""Verdicts in sorting order."""


def heading(result: Result, law: FrictionLaw, reference: Reference = NO_REFERENCE) -> Markup:
    """Render the lead of the page: log, law, number of joints per verdict, friction, trust and next step."""
    joints = result.joints
    named = {verdict: [name for name, joint in joints.items() if joint.verdict == verdict] for verdict in VERDICTS}
    findings = by_severity(result.findings)
    flagged = {name for finding in findings if finding.on_friction for name in finding.joints}
    identified = named["identified"]
    distrusted = {
        "warned": [name for name in identified if name in flagged],
        "weak": named["weak"],
        "not excited": named["not excited"],
    }
    steps: dict[str, list[str]] = {}  # next step and its joints
    for name, joint in joints.items():
        if joint.verdict in ("weak", "not excited"):
            steps.setdefault(advice(joint), []).append(name)
    r2 = [joint.torque_r2 for joint in joints.values() if joint.torque_r2]
    unseen = [share for joint in joints.values() if joint.curve and (share := unseen_r2(joint)) is not None]
    urgent = next((found for found in findings if found.cure), None)
    without = [_bound(joints[name]) for name in named["no friction"] if joints[name].curve]
    return render(
        "heading.html.j2",
        result=result,
        law=law,
        logs=[PurePath(path).name or "log in memory" for path in result.log.paths],
        named=named,
        range=_friction_range(result),
        known=reference,
        deviations=_deviations(result, reference),
        bound=_bound_text(max(without)) if without else "",
        r2=median(each.best for each in r2) if r2 else None,
        r2_nominal=median(each.nominal for each in r2) if r2 else None,
        unseen=median(unseen) if unseen else None,
        another=1.96 * max((point.between_logs for joint in joints.values() for point in joint.curve), default=0.0),
        between=logs_text(result),
        trusted=_named([name for name in identified if name not in flagged]),
        distrusted=[(why, _named(names)) for why, names in distrusted.items() if names],
        urgent=urgent,
        affected=_named(urgent.joints) if urgent else "",
        steps=[(_named(names), what) for what, names in steps.items()],
        warnings=len(findings),
    )


def unseen_r2(joint: JointResult) -> float | None:
    """Compute the share of the friction torque's mean square that the law explains on held-out data [1].

    None for joints without friction. Limited to a law that is 1000 times worse than zero friction.
    """
    found = joint.validation
    if found is None or found.rms_zero_friction <= 0 or joint.verdict == "no friction":
        return None
    return 1 - min(found.unexplained, 1e3) ** 2


def _friction_range(result: Result) -> list[tuple[str, str]]:
    """Find the smallest and largest identified friction at middle speed, with the joint; fewer if there are not two."""
    middles = {
        name: joint.curve[len(joint.curve) // 2]
        for name, joint in result.joints.items()
        if joint.verdict == "identified" and joint.curve and joint.torque_unit is None
    }
    ordered = sorted(middles, key=lambda name: middles[name].value)
    points = [(middles[name], name) for name in dict.fromkeys([*ordered[:1], *ordered[-1:]])]
    return [
        (
            f"{' ± '.join(brief(point.value, point.half_width))} {point.unit}",
            f"{name} at {number(point.velocity, 2)} {result.joints[name].units()[0]}",
        )
        for point, name in points
    ]


def _deviations(result: Result, reference: Reference) -> list[float]:
    """Compute the deviation of each identified curve from known friction, relative RMS over the curve's speeds [1]."""
    deviations = []
    for name, joint in result.joints.items():
        known = reference.without_offset(name)
        if known is None or joint.verdict != "identified" or not joint.curve:
            continue
        speeds, found = np.array([(point.velocity, point.value) for point in joint.curve]).T
        both = [np.interp(way * speeds, *known, left=np.nan, right=np.nan) for way in (1, -1)]
        truth = np.nanmean(np.abs(both), axis=0)
        if np.isfinite(truth).all() and truth.any():
            deviations.append(float(np.linalg.norm(found - truth) / np.linalg.norm(truth)))
    return deviations


def _named(names: Sequence[str]) -> str:
    """List joints by name, or their number if there are many."""
    return ", ".join(names) if len(names) <= 3 else f"{len(names)} joints"


def first_screen(result: Result, evidence: Evidence, reference: Reference = NO_REFERENCE) -> Section:
    """Render the curves, one line per joint (one for all joints without friction), and the warnings."""
    drawn = {
        name: friction_curve(
            joint,
            prismatic=name in evidence.prismatic,
            samples=joint_samples(evidence.samples, name, joint),
            reference=reference.without_offset(name),
        )
        for name, joint in result.joints.items()
    }
    curves = {name: curve for name, curve in drawn.items() if curve is not None}
    charts, finer = curve_charts(curves)
    anchors = {name: f"joint-{index}" for index, name in enumerate(result.joints)}
    flagged, places = {name for each in result.findings for name in each.joints}, [f"c{k}" for k in range(len(curves))]
    rows, without, bounds = [], [], []
    for index, (name, joint) in enumerate(result.joints.items()):
        if joint.verdict != "no friction":
            rows.append(_row(index, name, joint) | {"anchor": anchors[name], "flagged": name in flagged})
            continue
        bounds += [_bound(joint)] if joint.curve else []
        bound = _bound_text(_bound(joint)) if joint.curve else joint.reason
        without.append({"anchor": anchors[name], "name": name, "bound": bound})
    units = {row["unit"] for row in rows if row["unit"]}
    kinds = list(dict.fromkeys(curve.units for curve in curves.values())) or [("rad/s", "N m")]
    body = render(
        "first_screen.html.j2",
        figures=[
            {
                "chart": place,
                "name": name,
                "anchor": anchors[name],
                "verdict": result.joints[name].verdict,
                "finer": own,
                "unit": curves[name].units[1] if len(kinds) > 1 else "",
            }
            for place, name, own in zip(places, curves, finer, strict=True)
        ],
        rows=rows,
        without=without,
        warnings=warnings(result),
        known=reference,
        most=_bound_text(max(bounds)) if bounds else "",
        unit=min(units) if len(units) == 1 else "",
        units=[", ".join(dict.fromkeys(units)) for units in zip(*kinds, strict=True)],
        longest=24,  # characters of a joint's name that fit one line; longer names are broken, never cut
        compared=any(row["r2"] is not None for row in rows),
        total=len(result.joints),
    )
    named = zip(places, charts, strict=True)
    return Section(anchor="friction", title="Friction of every joint", body=body, charts=dict(named))


def _row(index: int, name: str, joint: JointResult) -> dict[str, Any]:
    speeds = [_cell(point, joint.units()[0]) for point in joint.curve]
    return {
        "index": index,
        "name": name,
        "verdict": joint.verdict,
        "order": VERDICTS.index(joint.verdict),
        "reason": joint.reason,
        "speeds": speeds if len(speeds) == 3 else [None] * 3,
        "unit": joint.curve[0].unit if joint.curve else "",
        "numbers": coulomb_and_viscous(joint),
        "r2": joint.torque_r2,
        "left": number(joint.validation.unexplained, 2) if joint.validation and joint.curve else "",
        "advice": advice(joint),
    }


def _cell(point: CurvePoint, speed_unit: str) -> dict[str, Any]:
    """Format the friction at a speed, or its bound if it is not significant, with a number for sorting."""
    significant = point.interval_95[0] > 0
    value, error = brief(point.value, point.half_width)
    return {
        "value": value if significant else f"< {number(point.interval_95[1], 2)}",
        "error": error if significant else "",
        "next_log": " to ".join(number(end, 2) for end in point.interval_next_log or ()),
        "velocity": number(point.velocity, 2),
        "speed_unit": speed_unit,
        "sort": f"{point.value:.6g}",
    }


def _bound(joint: JointResult) -> tuple[float, str]:
    """Find the upper bound of a joint's friction curve, and its unit."""
    return max(point.interval_95[1] for point in joint.curve), joint.curve[0].unit


def _bound_text(bound: tuple[float, str]) -> str:
    return f"below {number(bound[0], 2)} {bound[1]}"


def warnings(result: Result) -> Section | None:
    """Render the findings; None without any."""
    if not result.findings:
        return None
    body = render("warnings.html.j2", findings=by_severity(result.findings))
    return Section(anchor="warnings", title="Warnings", body=body)


def by_severity(findings: Sequence[Finding]) -> list[Finding]:
    """Sort findings: fatal ones first, then those on friction."""
    return sorted(findings, key=lambda finding: (not finding.stops, not finding.on_friction))
