"""Matplotlib figures of a result; the report draws its own in the page."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.errors import require_extra

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


Curve = tuple[Array, tuple[Array, Array | None]]
"""Velocities, shape (T,), and friction torque with its 95 % band, shapes (T,) and (2, T)."""


def friction_figure(drawings: Mapping[str, Callable[[Axes], object]], columns: int = 4) -> Figure:
    """Draw on axes in a grid, each with its title."""
    require_extra("plot", "matplotlib")
    from matplotlib.figure import Figure

    columns = max(min(columns, len(drawings)), 1)
    rows = max(-(-len(drawings) // columns), 1)
    figure = Figure(figsize=(2.8 * columns, 2.2 * rows), layout="constrained")  # [inch]
    grid = list(figure.subplots(rows, columns, squeeze=False).flat)
    for axes, (name, draw) in zip(grid, drawings.items(), strict=False):
        axes.set_title(name, fontsize=9)
        draw(axes)
    for axes in grid[len(drawings) :]:
        axes.set_visible(False)
    return figure


def draw_friction(
    axes: Axes, curve: Curve | None, samples: tuple[Array, Array] | None, units: tuple[str, str], verdict: str
) -> None:
    """Draw friction versus velocity, with samples and 95 % band; the verdict without a curve."""
    if curve is None:
        axes.text(0.5, 0.5, verdict, transform=axes.transAxes, ha="center", va="center", color="gray")
        axes.set_xticks([])
        axes.set_yticks([])
        return
    velocity, (torque, band) = curve
    if samples is not None:
        axes.plot(*samples, ".", color="0.7", markersize=2, zorder=1, rasterized=True)
        low, high = np.percentile(np.concatenate([np.percentile(samples[1], [2, 98]), torque]), [0, 100])
        axes.set_ylim(low - 0.1 * (high - low), high + 0.1 * (high - low))
    if band is not None:
        axes.fill_between(velocity, *band, color="C1", alpha=0.25, linewidth=0)
    axes.plot(velocity, torque, color="C1")
    axes.set_xlabel(f"velocity [{units[0]}]", fontsize=8)
    axes.set_ylabel(f"friction torque [{units[1]}]", fontsize=8)
    axes.tick_params(labelsize=8)
    axes.grid(alpha=0.25)


def velocity_grid(low: float, high: float, points: int = 31) -> Array:
    """Space about 3 `points` velocities between two limits, dense around zero, where friction changes quickly."""
    reach = max(abs(low), abs(high), 1e-300)  # avoids underflow
    near = np.geomspace(1e-3 * reach, 0.15 * reach, points // 2)
    grid = np.concatenate([np.linspace(low, high, 2 * points), -near, near, [0.0]])
    return np.unique(grid[(grid >= low) & (grid <= high)])
