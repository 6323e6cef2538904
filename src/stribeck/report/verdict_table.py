"""The verdict table: what the log says about each joint, on one screen."""

import numpy as np
from markupsafe import Markup

from stribeck.friction.law import FrictionLaw
from stribeck.report.joint_data import fitted_values
from stribeck.report.page import Section, render
from stribeck.report.reference import Reference
from stribeck.report.text import parameter_names, symbols
from stribeck.result import Evidence, JointResult, Result, TermVerdict
from stribeck.result.tables import friction_text
from stribeck.typing import Array

SIZE = (104.0, 30.0)
"""Width and height [SVG units, about a pixel each]."""

POINTS = 121
"""Points of the curve: about one a pixel."""


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
            "friction": friction_text(joint),
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


def sparkline(law: FrictionLaw, values: Array, velocity_range: tuple[float, float]) -> Markup:
    """Return the law over the velocities that the joint had, scaled to fill; values of shape (p,)."""
    velocity = np.linspace(*velocity_range, POINTS)
    torque = law.torque(velocity, values)
    width, height = SIZE
    reach = max(float(np.abs(torque).max()), 1e-12)
    x = np.linspace(1, width - 1, POINTS)
    y = height / 2 - torque / reach * (height / 2 - 2)
    curve = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    standstill = float(np.interp(0.0, velocity, x))
    return Markup(  # numbers alone  # nosec B704
        f'<svg class="sparkline" viewBox="0 0 {width:.0f} {height:.0f}" aria-hidden="true">'
        f'<path class="zero" d="M0 {height / 2:.1f}H{width:.0f}M{standstill:.1f} 0V{height:.0f}"/>'
        f'<polyline points="{curve}"/></svg>'
    )


def terms(result: Result) -> Section | None:
    """Return the section with a row a joint and a column a term, or None where a law was given."""
    chosen = {name: joint.terms for name, joint in result.joints.items() if joint.terms}
    if not chosen:
        return None
    names = list(dict.fromkeys(term for own in chosen.values() for term in own))
    common = {term: reason for term in names if (reason := _shared_reason([own[term] for own in chosen.values()]))}
    shown = [term for term in names if term not in common]
    rows = [
        {
            "name": name,
            "anchor": f"joint-{list(result.joints).index(name)}",
            "cells": [(own[term], _note(own[term])) for term in shown],
        }
        for name, own in chosen.items()
    ]
    body = render("terms.html.j2", columns=shown, rows=rows, common=common)
    return Section(anchor="terms", title="Terms of the law", body=body)


def _shared_reason(verdicts: list[TermVerdict]) -> str:
    """Return why a term was not tried in any joint, "" if it was, or if reasons differ."""
    reasons = {verdict.reason for verdict in verdicts}
    return reasons.pop() if len(reasons) == 1 and all(verdict.gain is None for verdict in verdicts) else ""


def _note(verdict: TermVerdict) -> str:
    """Return what the reason says beside the gain."""
    return verdict.reason if verdict.gain is None else verdict.reason.partition(", ")[2]
