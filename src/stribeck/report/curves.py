"""Every joint's friction curve with its band: small multiples on common scales."""

from dataclasses import dataclass

import numpy as np

from stribeck.base.typing import Array
from stribeck.report.charts import Chart, line, velocity_axes
from stribeck.result import JointResult, velocity_grid

FILLED = 0.4
"""Share of a common scale [1] that a curve must fill at least: one that fills less gets the next finer scale."""

NEAR = 0.8
"""Of two curves [1], the smaller over the larger, from which they share a scale that they fill half of `FILLED` of.

So left and right do, on either side of it.
"""

ABSURD = 1e12
"""Speed or torque from which nothing is drawn, nor below its inverse."""


@dataclass(frozen=True, eq=False, kw_only=True)
class FrictionCurve:
    """Friction of a joint over its velocities, the offset taken out.

    Attributes
    ----------
    velocity, torque
        [rad/s], [N m] (m/s and N of a prismatic joint), shape (K,).
    band
        Lower and upper end of its 95 % band [N m], shape (2, K); None where no covariance is known.
    prismatic
        Whether the joint slides: such joints have scales of their own.
    significant
        Whether friction is significant at any of the speeds at which the joint was judged.
    """

    velocity: Array
    torque: Array
    band: Array | None
    prismatic: bool
    significant: bool

    @property
    def size(self) -> tuple[float, float]:
        """Largest speed and largest torque, by which it is put on a common scale; a band counts up to as much again."""
        most = float(np.abs(self.torque).max())
        if self.band is not None and np.isfinite(self.band).all():
            most = min(float(np.abs(self.band).max()), 2 * most)
        return float(np.abs(self.velocity).max()), most

    @property
    def drawable(self) -> bool:
        """Whether it has a size that can be drawn."""
        if not np.isfinite(self.torque).all():
            return False
        speed, torque = self.size
        return 1 / ABSURD <= speed < ABSURD and (1 / ABSURD if self.significant else 0.0) <= torque < ABSURD


def friction_curve(joint: JointResult, *, prismatic: bool) -> FrictionCurve | None:
    """Return a joint's friction curve: of its law, or through the speeds at which it was judged; None without either.

    A joint without friction has none.
    """
    if joint.verdict in ("no friction", "not excited"):
        return None
    velocity = velocity_grid(*joint.velocity_range)
    fitted = joint.band(velocity, offset=False) if np.ptp(joint.velocity_range) > 0 else None
    if fitted is None:
        if not joint.curve:
            return None
        points = sorted(joint.curve, key=lambda point: point.velocity)
        velocity = np.array([point.velocity for point in points])
        fitted = np.array([point.value for point in points]), np.array([point.interval_95 for point in points]).T
    significant = not joint.curve or any(point.interval_95[0] > 0 for point in joint.curve)
    curve = FrictionCurve(
        velocity=velocity, torque=fitted[0], band=fitted[1], prismatic=prismatic, significant=significant
    )
    return curve if curve.drawable else None


def curve_charts(curves: dict[str, FrictionCurve]) -> tuple[list[Chart], list[bool]]:
    """Return a chart of each curve, and whether its scales are finer than the common ones."""
    scales: dict[str, tuple[float, float]] = {}
    finer: set[str] = set()
    for prismatic in (False, True):
        names = [name for name, curve in curves.items() if curve.prismatic == prismatic]
        sizes, worth = [curves[name].size for name in names], [curves[name].significant for name in names]
        own = [common_scales([size[axis] for size in sizes], worth) for axis in (0, 1)]
        scales |= dict(zip(names, zip(*own, strict=True), strict=True))
        finer |= {name for name in names if scales[name] != (max(own[0]), max(own[1]))}
    charts = []
    for name, curve in curves.items():
        (speed, torque), (own_speed, own_torque) = 1.06 * np.array([scales[name], curve.size])
        axes = velocity_axes(curve.prismatic, (-speed, speed), (-torque, torque))
        own_range = {"x": [-own_speed, own_speed], "y": [-own_torque, own_torque]}
        drawn = line(curve.velocity, curve.torque, "law", band=curve.band)
        charts.append({**axes, "lines": [drawn], "own": own_range, "sync": f"curves {curve.prismatic}"})
    return charts, [name in finer for name in curves]


def common_scales(sizes: list[float], shown: list[bool]) -> list[float]:
    """Return the scale of each curve: one for all but those that would fill too little of it, which share a finer one.

    Parameters
    ----------
    sizes
        Largest value of each curve.
    shown
        Whether its shape is worth a finer scale.
    """
    scales: list[float] = []
    previous = 0.0
    for size in sorted((size for size, worth in zip(sizes, shown, strict=True) if worth), reverse=True):
        if not scales or size < FILLED * scales[-1] * (0.5 if size > NEAR * previous else 1.0):
            scales.append(size)
        previous = size
    scales = scales or [max(sizes, default=1.0) or 1.0]
    return [min((scale for scale in scales if scale >= size), default=scales[0]) for size in sizes]
