"""Left against right: the laws of mirrored joints over each other, and whether they differ."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from markupsafe import Markup

from stribeck.friction.law import FrictionLaw
from stribeck.report.figure import COLOURS, inline_svg, new_axes
from stribeck.report.joint_data import JointData, joint_data
from stribeck.report.page import Section, render
from stribeck.result import Evidence, Result
from stribeck.result.compare import Difference, compare_sides
from stribeck.result.mirror import mirrored_pairs

SIDE_HEIGHT = 170.0
"""Height of a pair's figure [SVG units]."""


def sides(result: Result, evidence: Evidence, law: FrictionLaw) -> Section | None:
    """Return the section with a figure and a table row a pair, or None without a pair that has numbers."""
    pairs = mirrored_pairs(name for name, joint in result.joints.items() if joint.parameters)
    if not pairs:
        return None
    found = {(row.joint, row.parameter): row for row in compare_sides(result).rows}
    columns = list(dict.fromkeys(parameter for _, parameter in found))
    rows = [
        {"left": left, "right": right, "cells": [_cell(result, left, right, column, found) for column in columns]}
        for left, right in pairs
    ]
    figures = [
        (_pair_figure(f"s{index}", left, right, result, evidence, law), f"{left} and {right}")
        for index, (left, right) in enumerate(pairs)
    ]
    return Section(
        anchor="sides",
        title="Left against right",
        body=render("sides.html.j2", columns=columns, rows=rows, figures=figures),
    )


def _cell(
    result: Result, left: str, right: str, parameter: str, found: Mapping[tuple[str, str], Difference]
) -> dict[str, Any] | None:
    difference = found.get((f"{left} | {right}", parameter))
    if difference is None:
        return None
    return {
        "left": result.joints[left].parameters[parameter],
        "right": result.joints[right].parameters[parameter],
        "differs": not difference.agrees,
        "change": None if difference.percent is None else difference.percent / 100,
    }


def _pair_figure(prefix: str, left: str, right: str, result: Result, evidence: Evidence, law: FrictionLaw) -> Markup:
    data = {name: joint_data(name, result.joints[name], evidence, law, evidence.samples) for name in (left, right)}
    units = data[left]
    axes = new_axes(f"velocity [{units.velocity_unit}]", f"friction [{units.torque_unit}]", height=SIDE_HEIGHT)
    axes.axhline(0, color=COLOURS["muted"], linewidth=0.7)
    axes.axvline(0, color=COLOURS["muted"], linewidth=0.7)
    for name, colour in ((left, "data"), (right, "right")):
        _draw_law(axes, data[name], result.joints[name].velocity_range, COLOURS[colour])
    return inline_svg(axes, f"Fitted friction over velocity of {left} and of {right}", prefix)


def _draw_law(axes: Any, data: JointData, velocity_range: tuple[float, float], colour: str) -> None:
    grid = np.linspace(*velocity_range, 301)
    torque, band = data.predict(grid), data.band(grid)
    if torque is None:
        return
    if band is not None:
        axes.fill_between(grid, torque - band, torque + band, color=colour, alpha=0.25, linewidth=0)
    axes.plot(grid, torque, color=colour, linewidth=1.8)
