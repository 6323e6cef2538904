"""The four figures of a joint: friction over velocity, over time, its residual, and velocity coverage."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, NullLocator
from numpy.typing import NDArray

from stribeck.report.density import draw_density, robust_limits
from stribeck.report.figure import COLOURS, draw_steps, new_axes
from stribeck.report.joint_data import JointData
from stribeck.report.text import number
from stribeck.typing import Array

MOST_POINTS = 1200
"""Points of a line over time: about three for each pixel of its width."""

MOST_BREAK = 3.0
"""A line over time is broken where samples are further apart than this many usual steps."""


def friction_over_velocity(data: JointData) -> Axes:
    """Draw the samples' density, the fitted law and its 95 % band, and the reference where there is one."""
    axes = new_axes(f"velocity [{data.velocity_unit}]", f"friction [{data.torque_unit}]")
    limits = robust_limits(data.velocity, share=0.0, margin=0.03)
    grid = _velocity_grid(*limits)
    law, band = data.predict(grid), data.band(grid)
    low, high = robust_limits(data.torque)
    for curve in (law, data.reference[1] if data.reference else None):
        if curve is not None and np.isfinite(curve).all():
            low, high = min(low, 1.08 * float(curve.min())), max(high, 1.08 * float(curve.max()))
    draw_density(axes, data.velocity, data.torque, limits, (low, high))
    _zero_lines(axes)
    if law is not None and band is not None:
        axes.fill_between(grid, law - band, law + band, color=COLOURS["law"], alpha=0.28, linewidth=0, zorder=3)
    if law is not None:
        axes.plot(grid, law, color=COLOURS["law"], linewidth=1.8, zorder=4)
    if data.reference:
        axes.plot(*data.reference, color=COLOURS["ink"], linewidth=1.2, linestyle=(0, (4, 3)), zorder=5)
    return axes


def friction_over_time(data: JointData) -> Axes:
    """Draw the friction torque of a few seconds and what the law says it is."""
    axes = new_axes("time [s]", f"friction [{data.torque_unit}]")
    step = max(1, -(-len(data.time) // MOST_POINTS))
    time, velocity, torque = data.time[::step] - data.time[0], data.velocity[::step], data.torque[::step]
    breaks = np.flatnonzero(np.diff(time) > MOST_BREAK * np.median(np.diff(time))) + 1
    axes.plot(*_broken(time, torque, breaks), color=COLOURS["data"], linewidth=1.1)
    law = data.predict(velocity)
    if law is not None:
        axes.plot(*_broken(time, law, breaks), color=COLOURS["law"], linewidth=1.2)
    axes.margins(x=0.01)
    return axes


def residual_over_velocity(data: JointData, prediction: Array) -> Axes:
    """Draw the residual as a density with its mean; structure here is friction that the law does not have."""
    axes = new_axes(f"velocity [{data.velocity_unit}]", f"measured − law [{data.torque_unit}]")
    finite = np.isfinite(prediction)  # a law at a bound, such as a Stribeck velocity of zero, may have no value
    velocity, residual = data.velocity[finite], (data.torque - prediction)[finite]
    limits = robust_limits(data.velocity, share=0.0, margin=0.03)
    low, high = robust_limits(residual)
    reach = max(abs(low), abs(high))
    draw_density(axes, velocity, residual, limits, (-reach, reach))
    _zero_lines(axes)
    centre, mean = running_mean(velocity, residual, limits)
    axes.plot(centre, mean, color=COLOURS["law"], linewidth=1.5, zorder=4)
    return axes


def velocity_coverage(data: JointData, stribeck_velocity: float | None) -> Axes:
    """Draw how long the joint moved at which velocity, on a logarithmic scale, with the Stribeck velocity."""
    axes = new_axes(f"velocity [{data.velocity_unit}]", "time at velocity [s]")
    low, high = robust_limits(data.velocity, share=0.0, margin=0.03)
    counts, edges = np.histogram(data.velocity, bins=80, range=(low, high))
    seconds = counts * data.seconds_per_sample
    floor = 0.5 * data.seconds_per_sample
    draw_steps(axes, np.maximum(seconds, floor), edges, baseline=floor, opacity=0.75)
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: number(value, 1)))
    axes.yaxis.set_minor_locator(NullLocator())
    top = 6 * float(seconds.max())  # room for the words above the bars
    axes.set_ylim(floor, top)
    axes.set_xlim(low, high)
    if stribeck_velocity is not None:
        _mark_velocity(axes, stribeck_velocity, data.velocity_unit, low, high)
    return axes


def _mark_velocity(axes: Axes, velocity: float, unit: str, low: float, high: float) -> None:
    for signed in (-velocity, velocity):
        if low < signed < high:
            axes.axvline(signed, ymax=0.87, color=COLOURS["law"], linewidth=1.2, linestyle=(0, (3, 2)))
    axes.text(
        1.0,
        0.985,
        f"Stribeck velocity ±{number(velocity, 2)} {unit}",
        transform=axes.transAxes,
        horizontalalignment="right",
        verticalalignment="top",
        color=COLOURS["law"],
    )


def _zero_lines(axes: Axes) -> None:
    axes.axhline(0, color=COLOURS["muted"], linewidth=0.7, zorder=2)
    axes.axvline(0, color=COLOURS["muted"], linewidth=0.7, zorder=2)


def _velocity_grid(low: float, high: float) -> Array:
    """Return velocities from low to high, dense about zero, where the law turns."""
    reach = max(abs(low), abs(high))
    near = np.geomspace(1e-4 * reach, 0.1 * reach, 60)
    grid = np.concatenate([np.linspace(low, high, 160), -near, near, [0.0]])
    return np.unique(grid[(grid >= low) & (grid <= high)])


def _broken(x: Array, y: Array, breaks: NDArray[np.int64]) -> tuple[Array, Array]:
    """Return a line with a gap before each of these places."""
    return np.insert(x, breaks, np.nan), np.insert(y, breaks, np.nan)


def running_mean(x: Array, y: Array, limits: tuple[float, float], bins: int = 40) -> tuple[Array, Array]:
    """Return centres and means of y over bins of x; bins that hold less than 0.05 % of the samples are NaN."""
    counts, edges = np.histogram(x, bins=bins, range=limits)
    sums, _ = np.histogram(x, bins=bins, range=limits, weights=y)
    enough = counts >= max(3, 5e-4 * len(x))
    mean = np.divide(sums, counts, out=np.full(bins, np.nan), where=enough)
    return (edges[:-1] + edges[1:]) / 2, mean
