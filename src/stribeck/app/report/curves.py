"""Friction curves of all joints with their bands, and the comparison of two results."""

from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stribeck.app.comparison import Comparison, compare_sides
from stribeck.app.report.charts import Chart, Points, density, line, velocity_axes
from stribeck.app.report.joints import JointSamples
from stribeck.app.report.page import Section, render, section, write_page
from stribeck.core.base.typing import Array
from stribeck.core.result import JointResult, Result, velocity_grid
from stribeck.core.result.mirror import mirrored_pairs


@dataclass(frozen=True, eq=False, kw_only=True)
class FrictionCurve:
    """Friction of a joint versus velocity, without the offset.

    Attributes
    ----------
    velocity, torque
        Velocity [rad/s], [m/s] and torque [N m], [N], shape (K,).
    band
        Lower and upper end of the 95 % band [N m], [N], shape (2, K); None without a covariance.
    units
        Units of velocity and torque.
    samples
        Velocity and torque of the samples, without the offset, shape (N,) each; None to draw only the curve.
    reference
        Velocity and torque of the known friction, without the offset, shape (M,) each; None if unknown.
    """

    velocity: Array
    torque: Array
    band: Array | None
    units: tuple[str, str]
    samples: Points | None = None
    reference: Points | None = None

    @property
    def size(self) -> tuple[float, float]:
        """Largest speed and torque, which determine the scale; band and 90 % of the samples up to twice the curve."""
        curve = most = float(np.abs(self.torque).max())
        if self.band is not None and np.isfinite(self.band).all():
            most = float(np.abs(self.band).max())
        if self.samples is not None and len(self.samples[1]):
            most = max(most, float(np.quantile(np.abs(self.samples[1]), 0.9)))
        return float(np.abs(self.velocity).max()), min(most, 2 * curve)


def friction_curve(
    joint: JointResult, *, prismatic: bool, samples: JointSamples | None = None, reference: Points | None = None
) -> FrictionCurve | None:
    """Compute a joint's friction curve from its law, or from the points of its result; None without either.

    None for the verdict "no friction".
    """
    if joint.verdict in ("no friction", "not excited"):
        return None
    velocity = velocity_grid(*joint.velocity_range)
    fitted = joint.band(velocity) if np.ptp(joint.velocity_range) > 0 else None
    if fitted is None:
        if not joint.curve:
            return None
        points = sorted(joint.curve, key=lambda point: point.velocity)
        velocity = np.array([point.velocity for point in points])
        fitted = np.array([point.value for point in points]), np.array([point.interval_95 for point in points]).T
    curve = FrictionCurve(
        velocity=velocity,
        torque=fitted[0],
        band=fitted[1],
        units=joint.units(prismatic),
        samples=None if samples is None else (samples.velocity, samples.torque),
        reference=reference,
    )
    drawable = np.isfinite(curve.torque).all() and all(1e-12 <= size < 1e12 for size in curve.size)
    return curve if drawable else None


def curve_chart(name: str, curve: FrictionCurve) -> Chart:
    """Draw the curve of a joint on its own scale."""
    speed, torque = (1.06 * size for size in curve.size)
    axes = velocity_axes(curve.units, (-speed, speed), (-torque, torque))
    drawn = [line(curve.velocity, curve.torque, "law", band=curve.band)]
    if curve.reference:
        drawn.append(line(*curve.reference, "ink", "reference", width=1.2, dash=[4, 3]))
    images = [density(*curve.samples, (-speed, speed), (-torque, torque), (60, 100))] if curve.samples else []
    return {**axes, "lines": drawn, "images": images, "sync": f"curves {name}"}


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
    pairs = mirrored_pairs({name: joint for name, joint in result.joints.items() if joint.parameters})
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
