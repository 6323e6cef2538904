"""Charts as plain data, drawn by uPlot in the page (see `templates/page.js`)."""

import base64
import json
import struct
import zlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import ArrayLike, NDArray

from stribeck.core.base.typing import Array, BoolArray

Chart = dict[str, Any]
"""Axes `x` and `y` (see `axis`), `lines` (see `line`), `images`, upright `marks` and shaded `spans`.

`sync` names charts that zoom together; `residual` names the chart whose first line minus its others is drawn.
"""


Points = tuple[Array, Array]
"""Velocities [rad/s], [m/s] and torques [N m], [N], shape (N,) each."""

Limits = tuple[float, float]
"""Lowest and highest value of an axis."""

Figures = dict[str, tuple[Chart, str]]
"""Charts with captions, by their names in a page."""

POINTS = 24_000
"""Largest number of points of a line over time, summed over the joints."""


def axis(label: str, limits: Limits, **more: Any) -> dict[str, Any]:
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


def velocity_axes(units: tuple[str, str], velocity: Limits, torque: Limits) -> dict[str, Any]:
    """Describe the axes of friction versus velocity, with the units of velocity and torque."""
    return {"x": axis(f"velocity [{units[0]}]", velocity), "y": axis(f"friction [{units[1]}]", torque)}


def density(x: Array, y: Array, x_limits: Limits, y_limits: Limits, bins: tuple[int, int] = (90, 150)) -> Chart:
    """Describe samples of shape (N,) as an image whose opacity is their density; samples outside are omitted."""
    counts, _, _ = np.histogram2d(y, x, bins=bins, range=(y_limits, x_limits))
    opacity = np.where(counts > 0, 0.22 + 0.78 * np.log1p(counts) / np.log1p(max(float(counts.max()), 2.0)), 0.0)
    pixels = np.empty((*counts.shape, 4), dtype=np.uint8)
    pixels[..., :3] = (64, 133, 224)  # between the page's blues for light and dark
    pixels[..., 3] = 15 * np.round(17 * opacity[::-1])  # 18 levels; more are not visible and double the size
    return image(pixels, x_limits, y_limits)


def image(pixels: NDArray[np.uint8], x: Limits, y: Limits) -> dict[str, Any]:
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


def robust_limits(values: Array, share: float = 0.002, margin: float = 0.08) -> Limits:
    """Compute the slightly widened range of values of shape (N,) without the outermost samples."""
    low, high = np.quantile(values, [share, 1 - share]) if len(values) else (0.0, 0.0)
    pad = margin * (high - low) or 1e-3
    return float(low - pad), float(high + pad)


def over_time(
    time: Array, label: str, values: Sequence[Array], legend: Sequence[tuple[str, str]], points: int, sync: str
) -> Chart:
    """Draw values over time on an even grid; lines break at gaps and where a value is not finite.

    Parameters
    ----------
    time
        Times from zero [s], shape (T,).
    label
        Label of the vertical axis. It shows the first values, and others up to twice their range.
    values, legend
        Values, shape (T,), and color and label of each line; the first line is the thickest.
    points
        Largest number of points of a line.
    sync
        Name of the charts that zoom together.
    """
    step = max(float(np.median(np.diff(time))), float(time[-1]) / points)
    even = np.arange(0.0, float(time[-1]), step)
    rows = np.searchsorted(time, even).clip(max=len(time) - 1)
    near = np.abs(time[rows] - even) < 3 * step
    known = [series[np.isfinite(series)] for series in values]
    low, high = robust_limits(known[0], share=0.0)
    lowest, highest = robust_limits(np.concatenate(known), share=0.0)
    room = (high - low) / 2
    return {
        "x": axis("time [s]", (0.0, float(time[-1]))),
        "y": axis(label, (max(lowest, low - room), min(highest, high + room))),
        "lines": [
            line([0.0], np.where(near, series[rows], np.nan), *key, width=1.1 if k else 1.6, step=step)
            for k, (series, key) in enumerate(zip(values, legend, strict=True))
        ],
        "sync": sync,
    }


def with_residual(key: str, caption: str, chart: Chart, values: Sequence[Array], known: BoolArray) -> Figures:
    """Add a chart of the first line minus the others, which the page computes.

    `chart` is that of `over_time` with the `values`, named `key`; the scale fits the `known` samples, shape (T,).
    """
    errors = np.concatenate([(values[0] - value)[known] for value in values[1:]])
    reach = max(map(abs, robust_limits(errors[np.isfinite(errors)], share=0.002)))
    y = axis(chart["y"]["label"].replace("torque", "residual"), (-reach, reach))
    left = {**chart, "y": y, "lines": [], "residual": key}
    return {key: (chart, caption), f"{key}r": (left, f"{caption.partition(':')[0]}: measured minus predicted")}


def to_json(charts: Mapping[str, Chart]) -> Markup:
    """Format charts as JSON for a script element."""
    text = json.dumps(charts, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return Markup(text)  # contains no tag  # nosec B704


def _short(values: ArrayLike) -> list[float | None]:
    """Round numbers to five significant digits; null if not finite."""
    numbers = np.asarray(values, dtype=float).tolist()
    return [float(f"{number:.5g}") if -1e300 < number < 1e300 else None for number in numbers]
