"""Figures as inline SVG that takes its colours and its font from the page, light, dark or printed."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from markupsafe import Markup, escape
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

WIDTH = 360.0
"""Width of every figure [SVG units]; a phone shows it at about its own size, so its text stays readable."""

HEIGHT = 224.0
"""Height of a usual figure [SVG units]."""

POINTS_PER_INCH = 72.0

COLOURS = {name: f"#0102{index:02x}" for index, name in enumerate(("ink", "muted", "grid", "data", "law", "right"), 3)}
"""Stand-ins that matplotlib can draw with; the page's variable of that name takes their place."""

STYLE: dict[str, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "stribeck",  # the same figure gets the same ids every time
    "font.size": 9.5,
    "text.color": COLOURS["ink"],
    "axes.labelcolor": COLOURS["muted"],
    "axes.edgecolor": COLOURS["muted"],
    "axes.facecolor": "none",
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.unicode_minus": True,
    "axes.grid": True,
    "axes.axisbelow": True,
    "image.composite_image": False,  # each picture keeps its own pixels
    "figure.facecolor": "none",
    "grid.color": COLOURS["grid"],
    "grid.linewidth": 0.7,
    "lines.linewidth": 1.4,
    "xtick.color": COLOURS["muted"],
    "ytick.color": COLOURS["muted"],
    "xtick.bottom": False,  # the grid lines are the ticks
    "ytick.left": False,
    "xtick.major.pad": 4.0,
    "ytick.major.pad": 4.0,
}

_TAG = re.compile(r"<[^>]+>")
_REFERENCE = re.compile(r'(?:url\(#|href="#)([^)"]+)')
_ID = re.compile(r' id="([^"]+)"')
_LONG_NUMBER = re.compile(r"(\d+\.\d\d)\d+")
_LONG_SCALE = re.compile(r"(\d+\.\d{5})\d+")  # of pictures: it is multiplied by hundreds of pixels
_FONT = re.compile(r" font-family: [^;\"]+;?")
_COLOUR = re.compile("|".join(COLOURS.values()))
_VARIABLE = {stand_in: f"var(--{name})" for name, stand_in in COLOURS.items()}


@contextmanager
def house_style() -> Iterator[None]:
    """Draw as the page wants it, whatever the user's own matplotlib settings are; they come back afterwards."""
    with style.context(STYLE, after_reset=True):
        yield


def new_axes(x_label: str, y_label: str, *, height: float = HEIGHT, left: float = 50.0) -> Axes:
    """Return the only axes of a new figure, with room for its labels; nothing is laid out later, which is slow."""
    figure = Figure(figsize=(WIDTH / POINTS_PER_INCH, height / POINTS_PER_INCH), dpi=POINTS_PER_INCH)
    bottom, top, right = 32.0, 8.0, 8.0  # [SVG units]
    box = (left / WIDTH, bottom / height, 1 - (left + right) / WIDTH, 1 - (bottom + top) / height)
    axes = figure.add_axes(box)
    axes.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    axes.set_xlabel(x_label, labelpad=2)
    axes.set_ylabel(y_label, labelpad=2)
    return axes


def inline_svg(axes: Axes, label: str, name: str) -> Markup:
    """Return a figure as an `<svg>` element for the body of a page.

    Parameters
    ----------
    label
        What the figure shows, for those who cannot see it.
    name
        Unique in the page; keeps the ids of one figure apart from those of the others.
    """
    buffer = io.StringIO()
    figure = axes.get_figure(root=True)
    assert figure is not None  # for the type checker: `new_axes` made it
    nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    figure.savefig(buffer, format="svg", metadata=nothing)
    drawing = buffer.getvalue()
    body = drawing[drawing.index("</defs>") + len("</defs>") :]  # the first defs is a style for the whole page
    box = f"0 0 {figure.get_figwidth() * POINTS_PER_INCH:.0f} {figure.get_figheight() * POINTS_PER_INCH:.0f}"
    head = f'<svg viewBox="{box}" role="img" aria-label="{escape(label)}">'
    return Markup(head + _slim(body, name))


def _slim(body: str, name: str) -> str:
    """Keep what a browser needs: short numbers, ids that something refers to, the page's colours and font."""
    references = [identifier for tag in _TAG.findall(body) for identifier in _REFERENCE.findall(tag)]
    used = {identifier: f"{name}-{index}" for index, identifier in enumerate(dict.fromkeys(references))}

    def slim_tag(match: re.Match[str]) -> str:
        tag = _ID.sub(lambda found: f' id="{used[found[1]]}"' if found[1] in used else "", match[0])
        tag = _REFERENCE.sub(lambda found: found[0].replace(found[1], used[found[1]]), tag)
        tag = (_LONG_SCALE if "matrix(" in tag else _LONG_NUMBER).sub(r"\1", tag)
        tag = _COLOUR.sub(lambda found: _VARIABLE[found[0]], _FONT.sub("", tag))
        return re.sub(r"\s*\n\s*", " ", tag)

    return re.sub(r">\s*\n\s*<", "><", _TAG.sub(slim_tag, body))  # between tags only: texts stay as they are
