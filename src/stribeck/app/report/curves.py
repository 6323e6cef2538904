"""Friction curves of all joints with their bands, on common scales."""

from dataclasses import dataclass

import numpy as np

from stribeck.app.report.charts import Chart, density, line, velocity_axes
from stribeck.app.report.joints import JointSamples
from stribeck.core.base.typing import Array
from stribeck.core.result import JointResult, velocity_grid


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
        Units of velocity and torque; joints with different ones have separate scales.
    significant
        Whether friction is significant at any speed of the joint's friction curve.
    samples
        Velocity and torque of the samples, without the offset, shape (N,) each; None to draw only the curve.
    reference
        Velocity and torque of the known friction, without the offset, shape (M,) each; None if unknown.
    """

    velocity: Array
    torque: Array
    band: Array | None
    units: tuple[str, str]
    significant: bool
    samples: tuple[Array, Array] | None = None
    reference: tuple[Array, Array] | None = None

    @property
    def size(self) -> tuple[float, float]:
        """Largest speed and torque, which determine the scale; band and 90 % of the samples up to twice the curve."""
        curve = most = float(np.abs(self.torque).max())
        if self.band is not None and np.isfinite(self.band).all():
            most = float(np.abs(self.band).max())
        if self.samples is not None and len(self.samples[1]):
            most = max(most, float(np.quantile(np.abs(self.samples[1]), 0.9)))
        return float(np.abs(self.velocity).max()), min(most, 2 * curve)

    @property
    def drawable(self) -> bool:
        """Whether the curve can be drawn."""
        if not np.isfinite(self.torque).all():
            return False
        (speed, torque), absurd = self.size, 1e12  # largest speed or torque that is drawn; the smallest is its inverse
        return 1 / absurd <= speed < absurd and (1 / absurd if self.significant else 0.0) <= torque < absurd


def is_significant(joint: JointResult) -> bool:
    """Check that a joint's friction is significant at any speed of its curve; true without a curve."""
    return not joint.curve or any(point.interval_95[0] > 0 for point in joint.curve)


def friction_curve(
    joint: JointResult,
    *,
    prismatic: bool,
    samples: JointSamples | None = None,
    reference: tuple[Array, Array] | None = None,
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
        significant=is_significant(joint),
        samples=None if samples is None else (samples.velocity, samples.torque),
        reference=reference,
    )
    return curve if curve.drawable else None


def curve_charts(curves: dict[str, FrictionCurve]) -> tuple[dict[str, Chart], set[str]]:
    """Draw each curve, and name those with finer scales."""
    scales: dict[str, tuple[float, float]] = {}
    finer: set[str] = set()
    for units in dict.fromkeys(curve.units for curve in curves.values()):
        names = [name for name, curve in curves.items() if curve.units == units]
        sizes, worth = [curves[name].size for name in names], [curves[name].significant for name in names]
        group_scales = [common_scales([size[axis] for size in sizes], worth) for axis in (0, 1)]
        scales |= dict(zip(names, zip(*group_scales, strict=True), strict=True))
        finer |= {name for name in names if scales[name] != (max(group_scales[0]), max(group_scales[1]))}
    charts = {}
    for name, curve in curves.items():
        (speed, torque), (own_speed, own_torque) = 1.06 * np.array([scales[name], curve.size])
        axes = velocity_axes(curve.units, (-speed, speed), (-torque, torque))
        own_range = {"x": [-own_speed, own_speed], "y": [-own_torque, own_torque]}
        drawn = [line(curve.velocity, curve.torque, "law", band=curve.band)]
        if curve.reference:
            drawn.append(line(*curve.reference, "ink", "reference", width=1.2, dash=[4, 3]))
        images = [density(*curve.samples, (-speed, speed), (-torque, torque), (60, 100))] if curve.samples else []
        sync = f"curves {curve.units[1]}"
        charts[name] = {**axes, "lines": drawn, "images": images, "own": own_range, "sync": sync}
    return charts, finer


def common_scales(sizes: list[float], shown: list[bool]) -> list[float]:
    """Choose the scale of each curve: a common one, and finer ones for curves that fill less than 40 % of it.

    If the next larger curve has nearly the same size, 20 % is sufficient, so that left and right joints share a scale.

    Parameters
    ----------
    sizes
        Largest value of each curve.
    shown
        Whether the curve may get a finer scale.
    """
    scales: list[float] = []
    previous = 0.0
    for size in sorted((size for size, worth in zip(sizes, shown, strict=True) if worth), reverse=True):
        if not scales or size < scales[-1] * (0.2 if size > 0.8 * previous else 0.4):
            scales.append(size)
        previous = size
    scales = scales or [max(sizes, default=1.0) or 1.0]
    return [min((scale for scale in scales if scale >= size), default=scales[0]) for size in sizes]
