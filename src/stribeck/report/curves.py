"""Every joint's friction curve with its band: small multiples on common scales, drawn here and made live by uPlot."""

import json
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup, escape

from stribeck.friction.law import FrictionLaw
from stribeck.report.joint_data import errors_95, fitted_values
from stribeck.report.text import number
from stribeck.result import Evidence, JointResult, Result
from stribeck.typing import Array

FILLED = 0.4
"""Share of a common scale [1] that a curve must fill at least: one that fills less gets the next finer scale."""

NEAR = 0.8
"""Of two curves [1], the smaller over the larger, from which they share a scale that they fill half of `FILLED` of.

So left and right do, on either side of it.
"""

POINTS = 31
"""Of a curve on each side of standstill, and as many dense ones next to it, where the law turns."""

DIGITS = 5
"""Significant ones of the numbers that the page holds: finer than any screen."""

WIDTH, HEIGHT = 240.0, 150.0
"""Of the drawing for print and for pages without script [SVG units]."""

MARGIN = 0.06
"""Share of a scale [1] that stays free above the largest curve."""

ABSURD = 1e12
"""Speed or torque from which nothing is drawn, nor below its inverse."""


@dataclass(frozen=True, eq=False, kw_only=True)
class FrictionCurve:
    """Friction of a joint over its velocities, the offset taken out.

    Attributes
    ----------
    velocity, torque
        [rad/s], [N m] (m/s and N of a prismatic joint), shape (K,).
    low, high
        Ends of its 95 % band [N m], shape (K,); None where no covariance is known.
    prismatic
        Whether the joint slides: such joints have scales of their own.
    significant
        Whether friction is significant at any of the speeds at which the joint was judged.
    """

    velocity: Array
    torque: Array
    low: Array | None
    high: Array | None
    prismatic: bool
    significant: bool

    @property
    def fastest(self) -> float:
        """Largest speed, by which it is put on a common scale."""
        return float(np.abs(self.velocity).max())

    @property
    def largest(self) -> float:
        """Largest torque, by which it is put on a common scale; a band counts up to as much again."""
        most = float(np.abs(self.torque).max())
        if self.low is None or self.high is None:
            return most
        return min(max(float(np.abs(self.low).max()), float(np.abs(self.high).max())), 2 * most)

    @property
    def drawable(self) -> bool:
        """Whether it has a size that can be drawn."""
        sizes = np.array([self.fastest, self.largest])
        least = np.array([1 / ABSURD, 1 / ABSURD if self.significant else 0.0])
        return bool(np.isfinite(self.torque).all() and np.all((sizes >= least) & (sizes < ABSURD)))


def friction_curve(name: str, joint: JointResult, evidence: Evidence, law: FrictionLaw) -> FrictionCurve | None:
    """Return a joint's friction curve: of its law, or through the speeds at which it was judged; None without either.

    A joint without friction has none.
    """
    if joint.verdict in ("no friction", "not excited"):
        return None
    return curve_of(joint, law, *fitted_values(name, joint, evidence, law), prismatic=name in evidence.prismatic)


def curve_of(
    joint: JointResult, law: FrictionLaw, values: Array | None, covariance: Array | None, *, prismatic: bool
) -> FrictionCurve | None:
    """Return the friction curve of a joint's law with these values and their covariance, both in the law's order."""
    curve = None
    significant = not joint.curve or any(point.interval_95[0] > 0 for point in joint.curve)
    if values is not None and np.ptp(joint.velocity_range) > 0:
        kept = np.array([parameter.name != "offset" for parameter in law.parameters])
        velocity = velocity_grid(*joint.velocity_range)
        torque = law.torque(velocity, values * kept)
        half = None
        if covariance is not None and np.isfinite(covariance).all():
            J = law.jacobian(velocity, values * kept) * kept
            half = errors_95(joint, law) * np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", J, covariance, J), 0.0))
        curve = FrictionCurve(
            velocity=velocity,
            torque=torque,
            low=None if half is None else torque - half,
            high=None if half is None else torque + half,
            prismatic=prismatic,
            significant=significant,
        )
    elif joint.curve:
        points = sorted(joint.curve, key=lambda point: point.velocity)
        curve = FrictionCurve(
            velocity=np.array([point.velocity for point in points]),
            torque=np.array([point.value for point in points]),
            low=np.array([point.interval_95[0] for point in points]),
            high=np.array([point.interval_95[1] for point in points]),
            prismatic=prismatic,
            significant=significant,
        )
    return curve if curve is not None and curve.drawable else None


LEAST_REACH = 1e-300
"""Of velocities [rad/s], [m/s]; smaller numbers have no thousandth."""


def velocity_grid(low: float, high: float) -> Array:
    """Return velocities from low to high, dense about zero, where a law turns."""
    reach = max(abs(low), abs(high), LEAST_REACH)
    near = np.geomspace(1e-3 * reach, 0.15 * reach, POINTS // 2)
    grid = np.concatenate([np.linspace(low, high, 2 * POINTS), -near, near, [0.0]])
    return np.unique(grid[(grid >= low) & (grid <= high)])


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


def curve_figures(result: Result, curves: dict[str, FrictionCurve]) -> list[dict[str, object]]:
    """Return what the template draws of each curve, in the order of the robot, with its drawing and its scales."""
    order = list(result.joints)
    scales: dict[str, tuple[float, float]] = {}
    finer: set[str] = set()
    for prismatic in (False, True):
        of_kind = {name: curve for name, curve in curves.items() if curve.prismatic == prismatic}
        own = _scales(list(of_kind.values()))
        scales |= dict(zip(of_kind, own, strict=True))
        finer |= {name for name in of_kind if scales[name] != tuple(map(max, zip(*own, strict=True)))}
    return [
        {
            "name": name,
            "anchor": f"joint-{order.index(name)}",
            "verdict": result.joints[name].verdict,
            "finer": name in finer,
            "drawing": drawing(name, curve, scales[name]),
            "data": _plain(curve, scales[name]),
        }
        for name, curve in curves.items()
    ]


def _scales(curves: list[FrictionCurve]) -> list[tuple[float, float]]:
    """Return the speed and the torque at the ends of each curve's axes; all have the same units."""
    worth = [curve.significant for curve in curves]
    speeds = common_scales([curve.fastest for curve in curves], worth)
    torques = common_scales([curve.largest for curve in curves], worth)
    return [((1 + MARGIN) * speed, (1 + MARGIN) * torque) for speed, torque in zip(speeds, torques, strict=True)]


def _plain(curve: FrictionCurve, scale: tuple[float, float]) -> dict[str, object]:
    """Return a curve as the script takes it."""
    units = ("m/s", "N") if curve.prismatic else ("rad/s", "N m")
    lines = (curve.velocity, curve.torque, curve.low, curve.high)
    return {
        "lines": [None if line is None else [_short(value) for value in line] for line in lines],
        "scale": [_short(value) for value in scale],
        "own": [_short(curve.fastest * (1 + MARGIN)), _short(curve.largest * (1 + MARGIN))],
        "units": units,
    }


def _short(value: float) -> float | None:
    """Return a number with few digits, as far as JSON has it."""
    return float(f"{value:.{DIGITS}g}") if np.isfinite(value) else None


def script_data(figures: list[dict[str, object]]) -> Markup:
    """Return the curves as JSON that may stand in a script element."""
    text = json.dumps([figure["data"] for figure in figures], separators=(",", ":")).replace("<", "\\u003c")
    return Markup(text)  # no tag can begin in it  # nosec B704


def drawing(name: str, curve: FrictionCurve, scale: tuple[float, float]) -> Markup:
    """Return the curve and its band as an `<svg>`, with the ends of its scales."""
    x = WIDTH / 2 * (1 + curve.velocity / scale[0])

    def down(torque: Array) -> Array:
        return np.asarray(HEIGHT / 2 * (1 - np.clip(torque / scale[1], -1, 1)))

    band = ""
    if curve.low is not None and curve.high is not None and np.isfinite([curve.low, curve.high]).all():
        outline = _path(np.concatenate([x, x[::-1]]), np.concatenate([down(curve.high), down(curve.low)[::-1]]))
        band = f'<path class="band" d="{outline}Z"/>'
    across, up = ("m/s", "N") if curve.prismatic else ("rad/s", "N m")
    label = f"{name}: friction torque over velocity with its 95 % band, to {number(scale[0], 2)} {across}"
    return Markup(  # the label is escaped, the rest are numbers  # nosec B704
        f'<svg viewBox="0 0 {WIDTH:.0f} {HEIGHT:.0f}" role="img" aria-label="{escape(label)}">'
        f'<path class="zero" d="M0 {HEIGHT / 2:.0f}H{WIDTH:.0f}M{WIDTH / 2:.0f} 0V{HEIGHT:.0f}"/>'
        f'{band}<path class="line" d="{_path(x, down(curve.torque))}"/>'
        f'<text x="2" y="12">{number(scale[1], 2)} {up}</text>'
        f'<text class="end" x="{WIDTH - 2:.0f}" y="{HEIGHT / 2 + 14:.0f}">{number(scale[0], 2)} {across}</text></svg>'
    )


def _path(x: Array, y: Array) -> str:
    return "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(x, y, strict=True))
