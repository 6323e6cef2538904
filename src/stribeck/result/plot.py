"""Matplotlib figures of a result; the report draws its own in the page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from stribeck.base.typing import Array
from stribeck.errors import require_extra

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from stribeck.result.joint import JointResult


def friction_figure(joints: Mapping[str, JointResult], columns: int = 4, *, offset: bool = False) -> Figure:
    """Draw the friction curve of every joint with its 95 % band, in a grid."""
    require_extra("plot", "matplotlib")
    from matplotlib.figure import Figure

    columns = max(min(columns, len(joints)), 1)
    rows = max(-(-len(joints) // columns), 1)
    figure = Figure(figsize=(2.8 * columns, 2.2 * rows), layout="constrained")  # [inch]
    grid = list(figure.subplots(rows, columns, squeeze=False).flat)
    for axes, (name, joint) in zip(grid, joints.items(), strict=False):
        axes.set_title(name, fontsize=9)
        draw_friction(axes, joint, offset=offset)
    for axes in grid[len(joints) :]:
        axes.set_visible(False)
    return figure


def draw_friction(axes: Axes, joint: JointResult, *, offset: bool = False) -> None:
    """Draw the fitted law versus velocity, with samples and 95 % band; the verdict without a law."""
    velocity = velocity_grid(*joint.velocity_range)
    fitted = joint.band(velocity, offset=offset)
    if fitted is None:
        axes.text(0.5, 0.5, joint.verdict, transform=axes.transAxes, ha="center", va="center", color="gray")
        axes.set_xticks([])
        axes.set_yticks([])
        return
    torque, band = fitted
    speed, unit = joint.units()
    if joint.measured is not None:
        speeds, samples = joint.measured
        samples = samples - (0.0 if offset else joint.values.get("offset", 0.0))
        axes.plot(speeds, samples, ".", color="0.7", markersize=2, zorder=1, rasterized=True)
        low, high = np.percentile(np.concatenate([np.percentile(samples, [2, 98]), torque]), [0, 100])
        axes.set_ylim(low - 0.1 * (high - low), high + 0.1 * (high - low))
    if band is not None:
        axes.fill_between(velocity, *band, color="C1", alpha=0.25, linewidth=0)
    axes.plot(velocity, torque, color="C1")
    axes.set_xlabel(f"velocity [{speed}]", fontsize=8)
    axes.set_ylabel(f"friction torque [{unit}]", fontsize=8)
    axes.tick_params(labelsize=8)
    axes.grid(alpha=0.25)


def velocity_grid(low: float, high: float, points: int = 31) -> Array:
    """Space about 3 `points` velocities between two limits, dense around zero, where friction changes quickly."""
    reach = max(abs(low), abs(high), 1e-300)  # avoids underflow
    near = np.geomspace(1e-3 * reach, 0.15 * reach, points // 2)
    grid = np.concatenate([np.linspace(low, high, 2 * points), -near, near, [0.0]])
    return np.unique(grid[(grid >= low) & (grid <= high)])
