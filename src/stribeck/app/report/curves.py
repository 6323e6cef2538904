"""Friction curves of all joints with their bands."""

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
        absurd = 1e12  # largest speed or torque that is drawn; the smallest is its inverse
        return all(1 / absurd <= size < absurd for size in self.size)


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
        samples=None if samples is None else (samples.velocity, samples.torque),
        reference=reference,
    )
    return curve if curve.drawable else None


def curve_charts(curves: dict[str, FrictionCurve]) -> dict[str, Chart]:
    """Draw each curve on its own scale."""
    charts = {}
    for name, curve in curves.items():
        speed, torque = (1.06 * size for size in curve.size)
        axes = velocity_axes(curve.units, (-speed, speed), (-torque, torque))
        drawn = [line(curve.velocity, curve.torque, "law", band=curve.band)]
        if curve.reference:
            drawn.append(line(*curve.reference, "ink", "reference", width=1.2, dash=[4, 3]))
        images = [density(*curve.samples, (-speed, speed), (-torque, torque), (60, 100))] if curve.samples else []
        charts[name] = {**axes, "lines": drawn, "images": images, "sync": f"curves {name}"}
    return charts
