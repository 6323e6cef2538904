"""Many samples as a density: a small raster with a transparent ground that suits a light and a dark page."""

import numpy as np
from matplotlib.axes import Axes

from stribeck.typing import Array

BINS = (150, 90)
"""Columns and rows of the raster."""

HUE = (0.25, 0.52, 0.88)
"""Red, green and blue of the samples: in between the page's two blues for light and dark."""

FAINTEST = 0.22
"""Opacity of a cell that holds one sample."""


def robust_limits(values: Array, share: float = 0.002, margin: float = 0.08) -> tuple[float, float]:
    """Return the range that all but the outermost samples fill, a little widened; values of shape (N,)."""
    low, high = np.quantile(values, [share, 1 - share]) if len(values) else (0.0, 0.0)
    pad = margin * (high - low) or 1e-3
    return float(low - pad), float(high + pad)


def draw_density(axes: Axes, x: Array, y: Array, x_limits: tuple[float, float], y_limits: tuple[float, float]) -> None:
    """Draw samples of shape (N,) as a raster within the limits; samples outside are not drawn."""
    columns, rows = BINS
    column = ((x - x_limits[0]) * (columns / (x_limits[1] - x_limits[0]))).astype(np.int64)
    row = ((y - y_limits[0]) * (rows / (y_limits[1] - y_limits[0]))).astype(np.int64)
    inside = (x >= x_limits[0]) & (y >= y_limits[0]) & (column < columns) & (row < rows)
    counts = np.bincount(row[inside] * columns + column[inside], minlength=columns * rows).reshape(rows, columns)
    most = max(int(counts.max()), 2)
    opacity = np.where(counts > 0, FAINTEST + (1 - FAINTEST) * np.log1p(counts) / np.log1p(most), 0.0)
    image = np.empty((rows, columns, 4), dtype=np.uint8)
    image[..., :3] = np.round(255 * np.array(HUE))
    image[..., 3] = np.round(255 * opacity)
    axes.imshow(image, extent=(*x_limits, *y_limits), origin="lower", aspect="auto", interpolation="none", zorder=1)
    axes.set_xlim(*x_limits)
    axes.set_ylim(*y_limits)
