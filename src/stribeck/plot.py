"""Matplotlib figures of a result; the report draws its own in the page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from stribeck.core.errors import require_extra
from stribeck.core.result import JointResult, velocity_grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def plot_joints(joints: Mapping[str, JointResult], offset: bool, columns: int = 4) -> Figure:
    """Draw the friction of joints on axes in a grid, each with its name: `Result.plot`."""
    require_extra("plot", "matplotlib")
    from matplotlib.figure import Figure

    columns = max(min(columns, len(joints)), 1)
    rows = max(-(-len(joints) // columns), 1)
    figure = Figure(figsize=(2.8 * columns, 2.2 * rows), layout="constrained")  # [inch]
    grid = list(figure.subplots(rows, columns, squeeze=False).flat)
    for axes, (name, joint) in zip(grid, joints.items(), strict=False):
        axes.set_title(name, fontsize=9)
        plot_joint(joint, axes, offset)
    for axes in grid[len(joints) :]:
        axes.set_visible(False)
    return figure


def plot_joint(joint: JointResult, axes: Axes | None, offset: bool) -> Axes:
    """Draw friction versus velocity, with samples and 95 % band; the verdict without a curve: `JointResult.plot`."""
    require_extra("plot", "matplotlib")
    from matplotlib import pyplot

    axes = axes or pyplot.subplots()[1]
    velocity = velocity_grid(*joint.velocity_range)
    curve = joint.band(velocity, offset=offset)
    if curve is None:
        axes.text(0.5, 0.5, joint.verdict, transform=axes.transAxes, ha="center", va="center", color="gray")
        axes.set(xticks=[], yticks=[])
        return axes
    torque, band = curve
    if joint.measured is not None:
        samples = joint.measured[1] - (0.0 if offset else joint.values.get("offset", 0.0))
        axes.plot(joint.measured[0], samples, ".", color="0.7", markersize=2, zorder=1, rasterized=True)
        low, high = np.percentile(np.concatenate([np.percentile(samples, [2, 98]), torque]), [0, 100])
        axes.set_ylim(low - 0.1 * (high - low), high + 0.1 * (high - low))
    if band is not None:
        axes.fill_between(velocity, *band, color="C1", alpha=0.25, linewidth=0)
    axes.plot(velocity, torque, color="C1")
    speed, unit = joint.units()
    axes.set_xlabel(f"velocity [{speed}]", fontsize=8)
    axes.set_ylabel(f"friction torque [{unit}]", fontsize=8)
    axes.tick_params(labelsize=8)
    axes.grid(alpha=0.25)
    return axes
