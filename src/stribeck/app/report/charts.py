"""Charts as plain data, drawn by uPlot in the page (see `templates/page.js`)."""

import base64
import json
import struct
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import ArrayLike, NDArray

from stribeck.core.base.typing import Array

Chart = dict[str, Any]
"""Axes `x` and `y` (see `axis`), `lines` (see `line`), `images`, upright `marks` and shaded `spans`.

`sync` names charts that zoom together; `residual` names the chart whose first line minus its others is drawn.
"""


def axis(label: str, limits: tuple[float, float], **more: Any) -> dict[str, Any]:
    """Describe an axis; `names` are labels for 0, 1, 2, ..., or for the places `at`."""
    return {"label": label, "range": _short(limits), **more}


def line(
    x: ArrayLike, y: ArrayLike, colour: str, name: str = "", *, band: Array | None = None, **style: Any
) -> dict[str, Any]:
    """Describe a line in a color of the page; `name` is its label under the pointer.

    Parameters
    ----------
    x, y
        Points, shape (N,), x ascending; NaN breaks the line. With a `step` in the style, x has only the first value.
    band
        Lower and upper end of a band around the line, shape (2, N).
    **style
        `width` [px], `dash` [px, px], `opacity`, and `steps` (filled steps down to `base`).
    """
    series = {"x": _short(x), "y": _short(y), "colour": colour, "name": name, **style}
    if band is not None and np.isfinite(band).all():
        series |= {"low": _short(band[0]), "high": _short(band[1])}
    return series


def velocity_axes(units: tuple[str, str], velocity: tuple[float, float], torque: tuple[float, float]) -> dict[str, Any]:
    """Describe the axes of friction versus velocity, with the units of velocity and torque."""
    return {"x": axis(f"velocity [{units[0]}]", velocity), "y": axis(f"friction [{units[1]}]", torque)}


def density(
    x: Array, y: Array, x_limits: tuple[float, float], y_limits: tuple[float, float], bins: tuple[int, int] = (90, 150)
) -> dict[str, Any]:
    """Describe samples of shape (N,) as an image whose opacity is their density; samples outside are omitted."""
    counts, _, _ = np.histogram2d(y, x, bins=bins, range=(y_limits, x_limits))
    opacity = np.where(counts > 0, 0.22 + 0.78 * np.log1p(counts) / np.log1p(max(float(counts.max()), 2.0)), 0.0)
    pixels = np.empty((*counts.shape, 4), dtype=np.uint8)
    pixels[..., :3] = (64, 133, 224)  # between the page's blues for light and dark
    pixels[..., 3] = 15 * np.round(17 * opacity[::-1])  # 18 levels; more are not visible and double the size
    return image(pixels, x_limits, y_limits)


def image(pixels: NDArray[np.uint8], x: tuple[float, float], y: tuple[float, float]) -> dict[str, Any]:
    """Describe an image between limits, shape (rows, columns, 4): red, green, blue and opacity from the top down."""
    rows, columns, _ = pixels.shape
    flat = np.insert(pixels.reshape(rows, -1), 0, 0, axis=1)  # PNG filter of each row: none
    chunks = (
        (b"IHDR", struct.pack(">2I5B", columns, rows, 8, 6, 0, 0, 0)),
        (b"IDAT", zlib.compress(flat.tobytes(), 6)),
        (b"IEND", b""),
    )
    png = b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )
    source = "data:image/png;base64," + base64.b64encode(b"\x89PNG\r\n\x1a\n" + png).decode()
    return {"source": source, "x": _short(x), "y": _short(y)}


def robust_limits(values: Array, share: float = 0.002, margin: float = 0.08) -> tuple[float, float]:
    """Compute the slightly widened range of values of shape (N,) without the outermost samples."""
    low, high = np.quantile(values, [share, 1 - share]) if len(values) else (0.0, 0.0)
    pad = margin * (high - low) or 1e-3
    return float(low - pad), float(high + pad)


def to_json(charts: Mapping[str, Chart]) -> Markup:
    """Format charts as JSON for a script element."""
    text = json.dumps(charts, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return Markup(text)  # contains no tag  # nosec B704


def _short(values: ArrayLike) -> list[float | None]:
    """Round numbers to five significant digits; null if not finite."""
    numbers = np.asarray(values, dtype=float).tolist()
    return [float(f"{number:.5g}") if -1e300 < number < 1e300 else None for number in numbers]
