"""First screen of the report: picture of the robot, results, trust, next steps, and one line per joint."""

from collections.abc import Iterable
from operator import attrgetter
from pathlib import PurePath

import numpy as np
import pinocchio as pin
from markupsafe import Markup

from stribeck.app.report.curves import FrictionCurve, curve_chart, friction_curve
from stribeck.app.report.joints import joint_samples
from stribeck.app.report.page import Section, render, section, short_names
from stribeck.core.base.finding import Finding, catalogue
from stribeck.core.base.typing import Array
from stribeck.core.friction.law import FrictionLaw
from stribeck.core.result import Evidence, JointResult, ParameterEstimate, Result, Verdict
from stribeck.core.result.reference import NO_REFERENCE, Reference
from stribeck.core.result.tables import MAIN, advice, bound_text, logs_text, main_parameters, upper_bound
from stribeck.core.robot import Robot

VERDICTS: tuple[Verdict, ...] = ("identified", "weak", "not excited", "no friction")
"""Verdicts in sorting order."""

FIRST = 3
"""Findings, and weak joints, that a first screen shows; the others are in the report."""


def heading(result: Result, law: FrictionLaw, reference: Reference = NO_REFERENCE) -> Markup:
    """Render the lead of the page: log, law, number of joints per verdict, friction, trust and next step."""
    short = short_names(result.joints)
    joints = {short[name]: joint for name, joint in result.joints.items()}
    named = {verdict: [name for name, joint in joints.items() if joint.verdict == verdict] for verdict in VERDICTS}
    steps: dict[str, list[str]] = {}  # next step and its joints
    for name, joint in joints.items():
        if joint.verdict in ("weak", "not excited"):
            steps.setdefault(advice(joint), []).append(name)
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
        r2=[joint.torque_r2 for joint in joints.values() if joint.torque_r2],
        unseen=[share for joint in joints.values() if (share := joint.friction_r2) is not None],
        another=1.96 * max((point.between_logs for joint in joints.values() for point in joint.curve), default=0.0),
        between=logs_text(result.corrections, result.log.paths),
        steps=steps,
        warnings=[finding for finding in by_priority(result) if not finding.note],
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
    curves = dict[str, FrictionCurve]()
    for name, joint in result.joints.items():
        samples, known = joint_samples(evidence.samples, name, joint), reference.without_offset(name)
        if curve := friction_curve(joint, prismatic=name in evidence.prismatic, samples=samples, reference=known):
            curves[name] = curve
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
        {f"c{k}": (curve_chart(name, curve), name) for k, (name, curve) in enumerate(curves.items())},
        joints=result.joints,
        short=short_names(result.joints),
        columns={title: min(kinds) if len(kinds) == 1 else "" for title, kinds in columns.items() if kinds},
        names=MAIN,
        without={name: bound_text(joint) or joint.reason for name, joint in without.items()},
        own_units={name: curve.units[1] for name, curve in curves.items()} if len(kinds) > 1 else {},
        verdicts=VERDICTS,
        flagged={name for finding in result.findings if not finding.note for name in finding.joints},
        warnings=warnings(result),
        known=reference,
        most=_largest_bound(without.values()),
        unit=min(units) if len(units) == 1 else "",
        units=[", ".join(dict.fromkeys(units)) for units in zip(*kinds, strict=True)],
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


def robot_picture(robot: Robot, result: Result) -> Markup:
    """Draw the joints in the colors of their verdicts, in the middle of their positions in the log.

    An arm, which often moves about its stretched pose, is at three quarters. Joints without positions are at zero, or
    at the nearest limit.
    """
    model, data = robot.tree.model, robot.tree.model.createData()
    pose = np.clip(pin.neutral(model), model.lowerPositionLimit, model.upperPositionLimit)
    for name, joint in result.joints.items():
        if joint.position_range and model.existJointName(name):
            place = model.joints[model.getJointId(name)].idx_q
            pose[place] = np.quantile(joint.position_range, 0.5 if robot.tree.floating else 0.75)
    pin.forwardKinematics(model, data, pose)
    moving = range(2 if robot.tree.floating else 1, model.njoints)
    reach = np.linalg.norm([placement.translation for placement in model.jointPlacements], axis=1).max()
    levers = np.array([2 * inertia.lever for inertia in model.inertias])
    levers *= np.minimum(1.0, reach / np.maximum(np.linalg.norm(levers, axis=1, keepdims=True), 1e-9))
    ends = [data.oMi[k].act(levers[k]) for k in moving]
    points = np.array([*(data.oMi[k].translation for k in range(model.njoints)), *ends])
    flat = _projected(points - points[1 if robot.tree.floating else 0], robot.up)
    size = float(np.ptp(flat, axis=0).max()) or 1.0
    flat = (100 / size * (flat - flat.min(axis=0))).round(1)
    lines = [(int(model.parents[k]), k) for k in moving]
    lines += [(k, model.njoints + moving.index(k)) for k in set(moving) - set(model.parents)]
    joints = [(model.names[k], flat[k].tolist()) for k in moving if model.names[k] in result.joints]
    segments = [(*flat[a].tolist(), *flat[b].tolist()) for a, b in lines]
    box = [-6, -6, *(flat.max(axis=0) + 12).tolist()]
    return render("robot.html.j2", box=box, lines=segments, drawn=joints, joints=result.joints)


def _projected(points: Array, up: Array) -> Array:
    """Project points of shape (N, 3) to the right and down as seen from the front and slightly above, shape (N, 2)."""
    ahead = np.eye(3)[0 if abs(up[0]) < 0.9 else 2]
    ahead = ahead - (ahead @ up) * up
    ahead /= np.linalg.norm(ahead)
    left = np.cross(up, ahead)
    cosine, sine = np.cos(0.6), np.sin(0.6)  # angle from the front to the robot's right side [rad], separates limbs
    right, away = cosine * left + sine * ahead, sine * left - cosine * ahead
    return np.column_stack([points @ right, -points @ (up + 0.3 * away)])


def by_priority(result: Result) -> list[Finding]:
    """Sort findings: causes, then what may follow from them, such as drifts and bodies that differ, then notes.

    Findings of one kind are sorted by the friction of their joints that is unknown.
    """
    after, friction = catalogue()["after"], result.all_friction

    def rank(finding: Finding) -> tuple[float, ...]:
        follows = finding.on_friction or finding.check.startswith("bodies-") or finding.has("symptom")
        unknown = [unknown_friction(friction[name]) for name in finding.joints or friction if name in friction]
        kind = (not finding.stops, follows, not finding.doubt, not finding.cure, finding.check in after)
        return (finding.note, *kind, -max(unknown, default=0.0))

    return sorted(result.findings, key=rank)


def unknown_friction(joint: JointResult) -> float:
    """Compute half of a joint's widest 95 % interval of friction [N m], [N]; zero without a curve."""
    return max((point.half_width for point in joint.curve), default=0.0)
