"""First screen of the report: results, trust, next steps, and one line per joint."""

from collections.abc import Sequence
from pathlib import PurePath
from statistics import median

import numpy as np
from markupsafe import Markup

from stribeck.app.report.curves import curve_charts, friction_curve
from stribeck.app.report.joints import joint_samples
from stribeck.app.report.page import Section, render, section
from stribeck.app.report.text import number
from stribeck.core.base.finding import Finding
from stribeck.core.friction.law import FrictionLaw
from stribeck.core.result import CurvePoint, Evidence, JointResult, Result, Verdict
from stribeck.core.result.reference import NO_REFERENCE, Reference
from stribeck.core.result.tables import advice, logs_text, upper_bound

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
        bound=_bound_text(max(without, default=None)),
        r2=median(score.best for score in r2) if r2 else None,
        r2_nominal=median(score.nominal for score in r2) if r2 else None,
        unseen=median(unseen) if unseen else None,
        another=1.96 * max((point.between_logs for joint in joints.values() for point in joint.curve), default=0.0),
        between=logs_text(result.corrections, result.log.paths),
        trusted=[name for name in identified if name not in flagged],
        distrusted=distrusted,
        urgent=next((finding for finding in findings if finding.cure and not finding.has("note")), None),
        steps=steps,
        warnings=sum(not finding.has("note") for finding in findings),
    )


def unseen_r2(joint: JointResult) -> float | None:
    """Compute the share of the friction torque's mean square that the law explains on held-out data [1].

    None for joints without friction. Limited to a law that is 1000 times worse than zero friction.
    """
    validation = joint.validation
    if validation is None or validation.rms_zero_friction <= 0 or joint.verdict == "no friction":
        return None
    return 1 - min(validation.unexplained, 1e3) ** 2


def _friction_range(result: Result) -> list[tuple[str, CurvePoint]]:
    """Find the smallest and largest identified friction at middle speed, by joint; fewer if there are not two."""
    middles = {
        name: joint.curve[len(joint.curve) // 2]
        for name, joint in result.joints.items()
        if joint.verdict == "identified" and joint.curve and joint.torque_unit is None
    }
    ordered = sorted(middles, key=lambda name: middles[name].value)
    return [(name, middles[name]) for name in dict.fromkeys([*ordered[:1], *ordered[-1:]])]


def _deviations(result: Result, reference: Reference) -> list[float]:
    """Compute the deviation of each identified curve from known friction, relative RMS over the curve's speeds [1]."""
    deviations = []
    for name, joint in result.joints.items():
        known = reference.without_offset(name)
        if known is None or joint.verdict != "identified" or not joint.curve:
            continue
        speeds, values = np.array([(point.velocity, point.value) for point in joint.curve]).T
        both = [np.interp(way * speeds, *known, left=np.nan, right=np.nan) for way in (1, -1)]
        truth = np.nanmean(np.abs(both), axis=0)
        if np.isfinite(truth).all() and truth.any():
            deviations.append(float(np.linalg.norm(values - truth) / np.linalg.norm(truth)))
    return deviations


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
    shown = {name: joint for name, joint in result.joints.items() if joint.verdict != "no friction"}
    without = {name: joint for name, joint in result.joints.items() if joint.verdict == "no friction"}
    bounds = {name: _bound(joint) for name, joint in without.items() if joint.curve}
    units = {joint.curve[0].unit for joint in shown.values() if joint.curve}
    kinds = list(dict.fromkeys(curve.units for curve in curves.values())) or [("rad/s", "N m")]
    return section(
        "friction",
        "Friction of every joint",
        "first_screen",
        {f"c{k}": (chart, name) for k, (name, chart) in enumerate(charts.items())},
        joints=result.joints,
        shown=shown,
        without={name: _bound_text(bounds.get(name)) or joint.reason for name, joint in without.items()},
        places={name: index for index, name in enumerate(result.joints)},
        finer=finer,
        own_units={name: curve.units[1] for name, curve in curves.items()} if len(kinds) > 1 else {},
        verdicts=VERDICTS,
        flagged={name for finding in result.findings for name in finding.joints},
        warnings=warnings(result),
        known=reference,
        most=_bound_text(max(bounds.values(), default=None)),
        unit=min(units) if len(units) == 1 else "",
        units=[", ".join(dict.fromkeys(units)) for units in zip(*kinds, strict=True)],
        longest=24,  # characters of a joint's name that fit one line; longer names are broken, never cut
        compared=any(joint.torque_r2 for joint in shown.values()),
        rotors=any("armature" in joint.parameters for joint in shown.values()),
    )


def _bound(joint: JointResult) -> tuple[float, str]:
    """Find the upper bound of a joint's friction curve, and its unit."""
    return upper_bound(joint.curve), joint.curve[0].unit


def _bound_text(bound: tuple[float, str] | None) -> str:
    """Format an upper bound of friction; "" for none."""
    return f"below {number(bound[0], 2)} {bound[1]}" if bound else ""


def warnings(result: Result) -> Section | None:
    """Render the findings; None without any."""
    if not result.findings:
        return None
    return section("warnings", "Warnings", "warnings", findings=by_severity(result.findings))


def by_severity(findings: Sequence[Finding]) -> list[Finding]:
    """Sort findings: fatal ones first, then those on friction; notes come last."""
    return sorted(findings, key=lambda finding: (not finding.stops, finding.has("note"), not finding.on_friction))
