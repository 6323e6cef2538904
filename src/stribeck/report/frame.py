"""What is around the data of a figure: grid lines, their numbers, what the axes show.

matplotlib says where lines and numbers are; they are written here, since each of its ticks is an object that is made,
laid out and drawn on its own: most of the time of a report with hundreds of figures.
"""

from functools import cache

import numpy as np
from markupsafe import escape
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path

from stribeck.typing import Array

FONT_SIZE = 9.5
"""Of all that is written around the data [SVG units]."""

ASCENT, DESCENT = 0.759, 0.241
"""Of a line of text above and below where it stands [font sizes]."""

NUMBERS = 7.5
"""From the axes to their numbers [SVG units]."""

LABEL = 2.0
"""From the numbers to what the axis shows [SVG units]."""

SHARED = 3.0
"""From the axes or their numbers to what all the numbers share, e.g. a power of ten [SVG units]."""

LINE = 0.7
"""Width of a grid line [SVG units]."""

TOUCHES = 1e-6
"""A line this near to the end of an axis still belongs to it [SVG units]."""


def frame(axes: Axes, height: float) -> str:
    """Return grid lines, numbers and labels of a figure of this height [SVG units]; numbers are plain text, no TeX."""
    left, right, bottom, top = axes.bbox.x0, axes.bbox.x1, height - axes.bbox.y0, height - axes.bbox.y1
    x, x_numbers, x_shared = _numbers(axes.xaxis, left, right)
    y, y_numbers, y_shared = _numbers(axes.yaxis, bottom, top)
    lines = ""
    if axes.xaxis.get_tick_params()["gridOn"]:
        lines += "".join(f"M{at:.2f} {bottom:g}V{top:g}" for at in x)
    if axes.yaxis.get_tick_params()["gridOn"]:
        lines += "".join(f"M{left:g} {at:.2f}H{right:g}" for at in y)
    beneath = bottom + NUMBERS + ASCENT * FONT_SIZE
    next_line = beneath + (DESCENT + ASCENT) * FONT_SIZE
    widest = max((_width(number) for number in y_numbers), default=0.0)
    label_beside = left - NUMBERS - widest - LABEL - DESCENT * FONT_SIZE
    centre, middle = (left + right) / 2, (bottom + top) / 2
    texts = [
        *(_text(number, at, beneath) for at, number in zip(x, x_numbers, strict=True)),
        _text(x_shared, right, next_line + SHARED, "end"),
        _text(axes.get_xlabel(), centre, next_line + LABEL),
        *(
            _text(number, left - NUMBERS, at + ASCENT * FONT_SIZE / 2, "end")
            for at, number in zip(y, y_numbers, strict=True)
        ),
        _text(y_shared, left, top - SHARED, "start"),
        _text(axes.get_ylabel(), label_beside, middle, turned=True),
    ]
    grid = f'<path d="{lines}" style="fill: none; stroke: var(--grid); stroke-width: {LINE}"/>' if lines else ""
    return f'{grid}<g style="font-size: {FONT_SIZE}px; text-anchor: middle; fill: var(--muted)">{"".join(texts)}</g>'


def _numbers(axis: Axis, start: float, end: float) -> tuple[Array, list[str], str]:
    """Return where the lines of an axis between these places are [SVG units], their numbers, and what all share."""
    values = np.asarray(axis.get_majorticklocs(), dtype=float)
    formatter, scale = axis.get_major_formatter(), axis.get_transform()
    numbers = formatter.format_ticks(list(values))
    low, high = scale.transform(np.asarray(axis.get_view_interval(), dtype=float))
    places = start + (scale.transform(values) - low) / (high - low) * (end - start)
    shown = (places >= min(start, end) - TOUCHES) & (places <= max(start, end) + TOUCHES)
    return places[shown], [number for number, seen in zip(numbers, shown, strict=True) if seen], formatter.get_offset()


def _text(text: str, x: float, y: float, anchor: str = "middle", *, turned: bool = False) -> str:
    if not text:
        return ""
    style = "" if anchor == "middle" else f' style="text-anchor: {anchor}"'
    turn = f' transform="rotate(-90 {x:.2f} {y:.2f})"' if turned else ""
    return f'<text x="{x:.2f}" y="{y:.2f}"{style}{turn}>{escape(text)}</text>'


@cache
def _width(text: str) -> float:
    """Return how wide a text is [SVG units]."""
    return float(text_to_path.get_text_width_height_descent(text, FontProperties(size=FONT_SIZE), ismath=False)[0])
