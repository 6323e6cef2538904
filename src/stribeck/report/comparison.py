"""The page of `stribeck compare`: friction curves of all results over each other, and every parameter's changes."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup, escape

from stribeck.friction import get_law
from stribeck.friction.law import FrictionLaw
from stribeck.outputs import whole_or_not_at_all
from stribeck.report.curves import FrictionCurve, curve_of
from stribeck.report.figure import COLOURS, house_style, inline_svg, new_axes
from stribeck.report.joint_data import values_and_covariance
from stribeck.report.page import Section, render, render_page
from stribeck.report.text import number, percent
from stribeck.result import JointResult
from stribeck.result.compare import Difference
from stribeck.result.history import History, Trend

FIGURE_HEIGHT = 170.0
"""Height of a joint's figure [SVG units]."""

STRIP_WIDTH, STRIP_HEIGHT, STRIP_MARGIN = 120.0, 44.0, 6.0
"""Of the drawing of a parameter in all results [SVG units]."""

LARGEST_BAR = 5.0
"""Intervals are drawn up to so many times the range of the values, or of the smallest interval if it is larger [1]."""


def write_comparison(history: History, path: str | Path) -> None:
    """Write how results differ as one self-contained HTML file, whole or not at all.

    Examples
    --------
    >>> write_comparison(history(["out/result.json", result]), "compare.html")
    """
    with house_style():
        page = render_page(
            f"{history.robot}: {history.names[0]} to {history.names[-1]}",
            [section for section in (_curves(history), _parameters(history)) if section is not None],
            lead=render("comparison_heading.html.j2", history=history, changed=_changed(history)),
        )
    with whole_or_not_at_all(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def _changed(history: History) -> list[str]:
    """Return the last significant change of each parameter, and where it is gone again, in words."""
    found = []
    for row in history.rows:
        changes = [(k, change) for k, change in enumerate(row.changes) if change and change.significant]
        if changes:
            last, change = changes[-1]
            passing = "" if change is row.last_change else f" in {history.names[last]}, gone later"
            found.append(f"{row.joint} {row.parameter} {_size(change)}{passing}")
    return found


def _size(change: Difference) -> str:
    if change.percent is None:
        return "from next to nothing"
    return ("+" if change.percent > 0 else "") + percent(change.percent / 100)


def _curves(history: History) -> Section | None:
    """Return the section with a figure a joint; None where no result has a curve."""
    law = get_law(history.law)
    figures = []
    for index, (joint, own) in enumerate(history.joints.items()):
        curves = [None if each is None else _curve(each, law) for each in own]
        if any(curves):
            figures.append((_figure(f"c{index}", joint, curves), joint))
    if not figures:
        return None
    body = render("comparison_curves.html.j2", figures=figures, names=history.names)
    return Section(anchor="curves", title="Friction over velocity", body=body)


def _curve(joint: JointResult, law: FrictionLaw) -> FrictionCurve | None:
    """Return a joint's friction curve from what a result.json holds."""
    if joint.verdict in ("no friction", "not excited"):
        return None
    errors = np.array([each.standard_error for each in joint.parameters.values()])
    covariance = None if joint.correlation is None else np.array(joint.correlation) * np.outer(errors, errors)
    prismatic = bool(joint.curve) and joint.curve[0].unit == "N"
    return curve_of(joint, law, *values_and_covariance(joint, covariance, law), prismatic=prismatic)


def _figure(name: str, joint: str, curves: Sequence[FrictionCurve | None]) -> Markup:
    """Return a figure with the first curve and the last, their bands, and those between as thin lines."""
    prismatic = any(curve.prismatic for curve in curves if curve)
    units = ("m/s", "N") if prismatic else ("rad/s", "N m")
    axes = new_axes(f"velocity [{units[0]}]", f"friction [{units[1]}]", height=FIGURE_HEIGHT)
    axes.axhline(0, color=COLOURS["muted"], linewidth=0.7)
    axes.axvline(0, color=COLOURS["muted"], linewidth=0.7)
    for k, curve in enumerate(curves):
        if curve is None:
            continue
        ends = {0: "data", len(curves) - 1: "law"}
        colour = COLOURS[ends.get(k, "muted")]
        if k in ends and curve.low is not None and curve.high is not None:
            axes.fill_between(curve.velocity, curve.low, curve.high, color=colour, alpha=0.25, linewidth=0)
        axes.plot(curve.velocity, curve.torque, color=colour, linewidth=1.8 if k in ends else 0.8)
    return inline_svg(axes, f"Friction over velocity of {joint} in {len(curves)} results", name)


def _parameters(history: History) -> Section | None:
    """Return the section with a table: a row a joint, a column a parameter; None without parameters to compare."""
    columns = list(dict.fromkeys(row.parameter for row in history.rows))
    found = {(row.joint, row.parameter): row for row in history.rows}
    rows = [
        {"joint": joint, "cells": [_cell(found.get((joint, column)), history.names) for column in columns]}
        for joint in dict.fromkeys(row.joint for row in history.rows)
    ]
    if not rows:
        return None
    body = render("comparison.html.j2", columns=columns, rows=rows, history=history)
    return Section(anchor="parameters", title="Parameters", body=body)


def _cell(row: Trend | None, names: Sequence[str]) -> dict[str, Any] | None:
    if row is None:
        return None
    return {"row": row, "strip": _strip(row, names), "size": _size(row.last_change)}


def _strip(row: Trend, names: Sequence[str]) -> Markup:
    """Return a parameter in all results: a dot and its 95 % interval each, dashed the first value."""
    there = [
        (k, v, i) for k, (v, i) in enumerate(zip(row.values, row.intervals_95, strict=True)) if v is not None and i
    ]
    values = np.array([value for _, value, _ in there])
    reach = LARGEST_BAR * max(np.ptp(values), min(high - low for _, _, (low, high) in there))
    low = float(max(min(ends[0] for _, _, ends in there), values.min() - reach))
    high = float(min(max(ends[1] for _, _, ends in there), values.max() + reach))
    span = (high - low) or abs(high) or 1.0

    def down(value: float) -> float:
        share = (min(max(value, low), high) - low) / span
        return STRIP_MARGIN + (1 - share) * (STRIP_HEIGHT - 2 * STRIP_MARGIN)

    marks = []
    for k, value, (bottom, top) in there:
        x = STRIP_WIDTH * (k + 0.5) / len(names)
        change = row.changes[k]
        style = "changed" if change and change.significant else "first" if change is None else "same"
        title = f"{names[k]}: {number(value, 4)} [{number(bottom, 4)}, {number(top, 4)}] {row.unit}"
        marks.append(
            f'<g class="{style}"><title>{escape(title)}</title><path d="M{x:.1f} {down(bottom):.1f}V{down(top):.1f}"/>'
            f'<circle cx="{x:.1f}" cy="{down(value):.1f}" r="2.6"/></g>'
        )
    label = f"{row.joint}: {row.parameter} in {len(there)} results with 95 % intervals"
    size = f"{STRIP_WIDTH:.0f} {STRIP_HEIGHT:.0f}"
    return Markup(  # label and titles are escaped, the rest are numbers  # nosec B704
        f'<svg class="strip" viewBox="0 0 {size}" role="img" aria-label="{escape(label)}">'
        f'<path class="zero" d="M0 {down(row.first):.1f}H{STRIP_WIDTH:.0f}"/>{"".join(marks)}</svg>'
    )
