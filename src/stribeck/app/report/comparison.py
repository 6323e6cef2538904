"""Page of `stribeck compare`: friction curves and the change of every parameter."""

from collections.abc import Set as AbstractSet
from pathlib import Path

from stribeck.app.comparison import Comparison, compare_sides
from stribeck.app.report.charts import Chart, line, velocity_axes
from stribeck.app.report.curves import FrictionCurve, friction_curve
from stribeck.app.report.page import Section, render, section, write_page
from stribeck.core.result import Result
from stribeck.core.result.mirror import mirrored_pairs


def write_comparison(comparison: Comparison, path: str | Path) -> None:
    """Write the comparison as one self-contained HTML file, completely or not at all.

    Examples
    --------
    >>> write_comparison(compare("out/result.json", result), "compare.html")
    """
    lead = render("lead.html.j2", term="Change", text=comparison.conclusion, how=comparison.law)
    prismatic = {name for name, pair in comparison.joints.items() if any(joint.slides for joint in pair)}
    sections = [comparison_section(comparison, prismatic)]
    write_page(path, f"{comparison.robot}: {comparison.a} and {comparison.b}", sections, lead=lead)


def sides(result: Result, prismatic: AbstractSet[str]) -> Section | None:
    """Render the comparison of left and right joints; None without a pair that has parameters."""
    joints = {name: joint for name, joint in result.joints.items() if joint.parameters}
    pairs = mirrored_pairs(joints)
    if not pairs:
        return None
    labels = {f"{left} | {right}" for left, right in pairs if left in prismatic}
    return comparison_section(compare_sides(result), labels)


def comparison_section(comparison: Comparison, prismatic: AbstractSet[str]) -> Section:
    """Render a chart and table rows per joint or pair of joints."""
    figures = {}
    for index, (name, pair) in enumerate(comparison.joints.items()):
        curves = [friction_curve(joint, prismatic=name in prismatic) for joint in pair]
        if any(curves):
            figures[f"s{index}"] = _overlaid(curves, (comparison.a, comparison.b)), name
    units: dict[str, set[str]] = {}
    rows: dict[str, dict[str, object]] = {}
    for row in comparison.rows:
        units.setdefault(row.parameter, set()).add(row.unit)
        rows.setdefault(row.joint, {})[row.parameter] = row
    columns = {key: min(kinds) if len(kinds) == 1 else "" for key, kinds in units.items()}  # cells contain mixed units
    title = "Left against right" if comparison.a == "left" else f"{comparison.a} against {comparison.b}"
    return section("sides", title, "comparison", figures, found=comparison, columns=columns, rows=rows)


def _overlaid(curves: list[FrictionCurve | None], names: tuple[str, str]) -> Chart:
    drawn = [
        (curve, line(curve.velocity, curve.torque, colour, name, band=curve.band))
        for curve, colour, name in zip(curves, ("data", "right"), names, strict=True)
        if curve
    ]
    speed, torque = (1.06 * max(curve.size[axis] for curve, _ in drawn) for axis in (0, 1))
    axes = velocity_axes(drawn[0][0].units, (-speed, speed), (-torque, torque))
    return {**axes, "lines": [trace for _, trace in drawn]}
