"""A panel a joint: its numbers and its four figures; a short one where the log shows too little motion."""

from markupsafe import Markup

from stribeck.friction.law import FrictionLaw
from stribeck.report.figure import inline_svg
from stribeck.report.joint_data import JointData, joint_data
from stribeck.report.joint_figures import (
    friction_over_time,
    friction_over_velocity,
    residual_over_velocity,
    velocity_coverage,
)
from stribeck.report.page import Section, render
from stribeck.report.reference import Reference
from stribeck.report.text import number, symbols
from stribeck.result import Evidence, JointResult, Result
from stribeck.result.tables import friction_text

Figures = list[tuple[Markup, str]]
"""Drawings with their captions."""


def joint_panels(result: Result, evidence: Evidence, law: FrictionLaw, reference: Reference) -> Section:
    """Return the section with every joint's panel, in the order of the result."""
    panels = []
    for index, (name, joint) in enumerate(result.joints.items()):
        data = joint_data(name, joint, evidence, law, evidence.samples, reference)
        figures = _figures(f"j{index}", name, joint, data)
        close_up = _close_up_figure(f"j{index}t", name, joint, evidence, law)
        if close_up is not None and joint.parameters:
            figures.insert(1, close_up)
        panels.append(
            {
                "anchor": f"joint-{index}",
                "name": name,
                "joint": joint,
                "friction": friction_text(joint),
                "figures": figures,
                "reference": reference.parameters.get(name, {}),
                "unit": data.torque_unit,
                "velocity_unit": data.velocity_unit,
            }
        )
    body = render("joint_panels.html.j2", panels=panels, symbols=symbols(law), known=reference)
    return Section(anchor="joints", title="Joints", body=body)


def _figures(prefix: str, name: str, joint: JointResult, data: JointData) -> Figures:
    """Return the figures over velocity; without a fitted law, the samples alone."""
    if not len(data.velocity):
        return []
    low, high = joint.velocity_range
    span = f"from {number(low)} to {number(high)} {data.velocity_unit}"
    over_velocity = inline_svg(
        friction_over_velocity(data),
        f"{name}: friction torque over velocity {span}",
        f"{prefix}v",
    )
    prediction = data.predict(data.velocity)
    if prediction is None:
        why = "no friction is detectable" if joint.verdict == "no friction" else "no law is fitted"
        return [(over_velocity, f"Friction torque over velocity: samples only, {why}.")]
    residual = inline_svg(
        residual_over_velocity(data, prediction),
        f"{name}: residual of the friction torque, over velocity",
        f"{prefix}r",
    )
    stribeck_velocity = joint.parameters.get("stribeck_velocity")
    coverage = inline_svg(
        velocity_coverage(data, stribeck_velocity.value if stribeck_velocity else None),
        f"{name}: time at each velocity {span}",
        f"{prefix}c",
    )
    return [
        (over_velocity, "Friction torque over velocity"),
        (residual, "Residual of the law, and its mean"),
        (coverage, "Velocity coverage"),
    ]


def _close_up_figure(
    prefix: str, name: str, joint: JointResult, evidence: Evidence, law: FrictionLaw
) -> tuple[Markup, str] | None:
    if evidence.close_up is None:
        return None
    data = joint_data(name, joint, evidence, law, evidence.close_up)
    if len(data.time) < 2:
        return None
    span = f"{data.time[0]:.2f} to {data.time[-1]:.2f} s of the log"
    label = f"{name}: friction torque and law over time, {span}"
    drawing = inline_svg(friction_over_time(data), label, prefix)
    return drawing, f"Over time, {span}"
