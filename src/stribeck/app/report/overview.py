"""First screen of the report: results, trust, next steps, and one line per joint."""

from collections.abc import Iterable
from operator import attrgetter
from pathlib import PurePath
from statistics import median

import numpy as np
from markupsafe import Markup

from stribeck.app.priorities import FIRST, by_priority
from stribeck.app.report.curves import curve_charts, friction_curve
from stribeck.app.report.joints import joint_samples
from stribeck.app.report.page import Section, render, section
from stribeck.app.report.text import short_names
from stribeck.core.friction.law import FrictionLaw
from stribeck.core.result import Evidence, JointResult, ParameterEstimate, Result, Verdict
from stribeck.core.result.reference import NO_REFERENCE, Reference
from stribeck.core.result.tables import MAIN, advice, bound_text, logs_text, main_parameters, upper_bound

VERDICTS: tuple[Verdict, ...] = ("identified", "weak", "not excited", "no friction")
"""Verdicts in sorting order."""


def heading(result: Result, law: FrictionLaw, reference: Reference = NO_REFERENCE) -> Markup:
    """Render the lead of the page: log, law, number of joints per verdict, friction, trust and next step."""
    short = short_names(result.joints)
    joints = {short[name]: joint for name, joint in result.joints.items()}
    named = {verdict: [name for name, joint in joints.items() if joint.verdict == verdict] for verdict in VERDICTS}
    findings = by_priority(result)
    steps: dict[str, list[str]] = {}  # next step and its joints
    for name, joint in joints.items():
        if joint.verdict in ("weak", "not excited"):
            steps.setdefault(advice(joint), []).append(name)
    r2 = [joint.torque_r2 for joint in joints.values() if joint.torque_r2]
    unseen = [share for joint in joints.values() if (share := joint.friction_r2) is not None]
    return render(
        "heading.html.j2",
        result=result,
        law=law,
        logs=[PurePath(path).name or "log in memory" for path in result.log.paths],
        named=named,
        ranges=_main_ranges(result),
        known=reference,
        deviations=_deviations(result, reference),
        bound=_largest_bound(joints[name] for name in named["no friction"]),
        r2=median(score.best for score in r2) if r2 else None,
        r2_nominal=median(score.nominal for score in r2) if r2 else None,
        unseen=median(unseen) if unseen else None,
        another=1.96 * max((point.between_logs for joint in joints.values() for point in joint.curve), default=0.0),
        between=logs_text(result.corrections, result.log.paths),
        distrusted={verdict: named[verdict] for verdict in ("weak", "not excited")},
        urgent=next((finding for finding in findings if finding.cure and not finding.note), None),
        steps=steps,
        warnings=sum(not finding.note for finding in findings),
    )


def _main_ranges(result: Result) -> list[tuple[str, ParameterEstimate, ParameterEstimate]]:
    """Find the smallest and largest value of each main parameter and unit over the identified joints."""
    groups: dict[tuple[str, str], list[ParameterEstimate]] = {}
    for joint in result.joints.values():
        for title, name in MAIN.items() if joint.verdict == "identified" else ():
            ways = [joint.parameters.get(name + way) for way in ("", "_positive", "_negative")]
            for estimate in ways:
                if estimate is not None and estimate.verdict == "identified":
                    groups.setdefault((title, estimate.unit), []).append(estimate)
    by_value = attrgetter("value")
    return [(title, min(group, key=by_value), max(group, key=by_value)) for (title, _), group in groups.items()]


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
    shown = {name: joint for name, joint in result.joints.items() if joint.verdict != "no friction"}
    without = {name: joint for name, joint in result.joints.items() if joint.verdict == "no friction"}
    units = {joint.curve[0].unit for joint in shown.values() if joint.curve}
    columns: dict[str, set[str]] = {}  # units of the main parameters
    for joint in shown.values():
        for title, (text, unit) in zip(MAIN, main_parameters(joint), strict=True):
            columns.setdefault(title, set()).update([unit] if text else [])
    kinds = list(dict.fromkeys(curve.units for curve in curves.values())) or [("rad/s", "N m")]
    return section(
        "friction",
        "Friction of every joint",
        "first_screen",
        {f"c{k}": (chart, name) for k, (name, chart) in enumerate(curve_charts(curves).items())},
        joints=result.joints,
        short=short_names(result.joints),
        shown=shown,
        columns={title: min(kinds) if len(kinds) == 1 else "" for title, kinds in columns.items() if kinds},
        names=MAIN,
        without={name: bound_text(joint) or joint.reason for name, joint in without.items()},
        places={name: index for index, name in enumerate(result.joints)},
        own_units={name: curve.units[1] for name, curve in curves.items()} if len(kinds) > 1 else {},
        verdicts=VERDICTS,
        flagged={name for finding in result.findings if not finding.note for name in finding.joints},
        warnings=warnings(result),
        known=reference,
        most=_largest_bound(without.values()),
        unit=min(units) if len(units) == 1 else "",
        units=[", ".join(dict.fromkeys(units)) for units in zip(*kinds, strict=True)],
        longest=24,  # characters of a joint's name that fit one line; longer names are broken, never cut
    )


def _largest_bound(joints: Iterable[JointResult]) -> str:
    """Format the largest upper bound of the friction of joints; "" without any."""
    known = [joint for joint in joints if joint.curve]
    return bound_text(max(known, key=lambda joint: upper_bound(joint.curve))) if known else ""


def warnings(result: Result) -> Section | None:
    """Render the findings, only the first warnings open; None without any."""
    if not result.findings:
        return None
    findings = by_priority(result)
    shown = [finding for finding in findings if not finding.note][:FIRST]
    return section("warnings", "Warnings", "warnings", findings=shown, others=findings[len(shown) :])
