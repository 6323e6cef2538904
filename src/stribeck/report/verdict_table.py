"""The verdict table: what the log says about each joint, on one screen."""

from __future__ import annotations

from markupsafe import Markup

from stribeck.friction.law import FrictionLaw
from stribeck.report.joint_data import fitted_values
from stribeck.report.page import Section, render
from stribeck.report.reference import Reference
from stribeck.report.sparkline import sparkline
from stribeck.report.text import parameter_names, symbols
from stribeck.result import Evidence, JointResult, Result


def verdict_table(result: Result, evidence: Evidence, law: FrictionLaw, reference: Reference) -> Section:
    """Return the section with a row a joint: verdict, reason, parameters, validation."""
    names = parameter_names(result, law)
    known = symbols(law)
    columns = [{"name": name, "symbol": known.get(name, ""), "unit": _unit(result, name, law)} for name in names]
    rows = [
        {
            "name": name,
            "joint": joint,
            "reference": reference.parameters.get(name, {}),
            "explained": explained(joint),
            "unit": "N" if name in evidence.prismatic else "N m",
            "sparkline": _sparkline(name, joint, evidence, law),
        }
        for name, joint in result.joints.items()
    ]
    return Section(
        anchor="verdicts",
        title="Verdicts",
        body=render("verdict_table.html.j2", columns=columns, rows=rows, word=reference.word),
    )


def _sparkline(name: str, joint: JointResult, evidence: Evidence, law: FrictionLaw) -> Markup | None:
    values, _ = fitted_values(name, joint, evidence, law)
    return None if values is None else sparkline(law, values, joint.velocity_range)


def explained(joint: JointResult) -> float | None:
    """Return the share of the friction torque's rms, on blocks that no fit saw, that the law takes away."""
    validation = joint.validation
    if validation is None or validation.rms_zero_friction <= 0:
        return None
    return 1 - validation.rms / validation.rms_zero_friction


def _unit(result: Result, name: str, law: FrictionLaw) -> str:
    """Return the unit that most joints have; the cells of the others say their own."""
    units: dict[str, int] = {}
    for joint in result.joints.values():
        if name in joint.parameters:
            unit = joint.parameters[name].unit
            units[unit] = units.get(unit, 0) + 1
    if units:
        return max(units, key=units.__getitem__)
    return next((parameter.unit for parameter in law.parameters if parameter.name == name), "1")
