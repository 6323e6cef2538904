"""Figures as inline SVG that takes its colours and its font from the page, light, dark or printed."""

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from threading import RLock
from typing import Any
from warnings import catch_warnings, filterwarnings

import numpy as np
from markupsafe import Markup, escape
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import StepPatch
from matplotlib.ticker import MaxNLocator, ScalarFormatter

from stribeck.report.frame import FONT_SIZE, frame
from stribeck.typing import Array

WIDTH = 360.0
"""Width of every figure [SVG units]; a phone shows it at about its own size, so its text stays readable."""

HEIGHT = 224.0
"""Height of a usual figure [SVG units]."""

POINTS_PER_INCH = 72.0

COLOURS = {name: f"#0102{index:02x}" for index, name in enumerate(("ink", "muted", "data", "law", "right"), 3)}
"""Stand-ins that matplotlib can draw with; the page's variable of that name takes their place."""

STYLE: dict[str, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "stribeck",  # the same figure gets the same ids every time
    "font.size": FONT_SIZE,
    "text.color": COLOURS["ink"],
    "axes.edgecolor": COLOURS["muted"],
    "axes.facecolor": "none",
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.unicode_minus": True,
    "axes.grid": True,
    "image.composite_image": False,  # each picture keeps its own pixels
    "figure.facecolor": "none",
    "lines.linewidth": 1.4,
}

_TAG = re.compile(r"<[^>]+>")
_REFERENCE = re.compile(r'(?:url\(#|href="#)([^)"]+)')
_ID = re.compile(r' id="([^"]+)"')
_NEEDLESS_DIGITS = re.compile(r"(?<=\.\d\d)\d+")
_NEEDLESS_OF_SCALE = re.compile(r"(?<=\.\d{5})\d+")  # of pictures: it is multiplied by hundreds of pixels
_FONT = re.compile(r" font-family: [^;\"]+;?")
_COLOUR = re.compile("|".join(COLOURS.values()))
_VARIABLE = {stand_in: f"var(--{name})" for name, stand_in in COLOURS.items()}


_TURN = RLock()
"""Held while a page is drawn: matplotlib's settings, Python's warnings and `_DRAWN` are those of the whole process."""


@contextmanager
def house_style() -> Iterator[None]:
    """Draw as the page wants it, whatever the user's own matplotlib settings are; they come back afterwards.

    Pages are drawn one after another, whichever threads ask for them.
    """
    with _TURN, style.context(STYLE, after_reset=True), np.errstate(all="ignore"), catch_warnings():
        filterwarnings("ignore", "Glyph .* missing")  # it is the browser that draws texts
        try:
            yield
        finally:
            _DRAWN.clear()


_DRAWN: list[Axes] = []
"""Axes whose figure is drawn: the next figure takes them, since new ones cost more than what is drawn in them."""


def new_axes(x_label: str, y_label: str, *, height: float = HEIGHT, left: float = 50.0) -> Axes:
    """Return the only axes of a figure, empty, with room for its labels; nothing is laid out later, which is slow."""
    axes = _emptied(_DRAWN.pop()) if _DRAWN else _bare()
    figure = axes.get_figure(root=True)
    assert figure is not None  # for the type checker: it was made with them
    bottom, top, right = 32.0, 8.0, 8.0  # [SVG units]
    figure.set_size_inches(WIDTH / POINTS_PER_INCH, height / POINTS_PER_INCH)
    axes.set_position((left / WIDTH, bottom / height, 1 - (left + right) / WIDTH, 1 - (bottom + top) / height))
    axes.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    return axes


def _bare() -> Axes:
    """Return new axes that draw nothing but what is drawn in them: the ground is the page's, around them is `frame`."""
    figure = Figure(dpi=POINTS_PER_INCH)
    axes = figure.add_axes((0, 0, 1, 1))
    for hidden in (figure.patch, axes.patch, axes.xaxis, axes.yaxis):
        hidden.set_visible(False)
    return axes


def _emptied(axes: Axes) -> Axes:
    """Return axes as they were when they were new."""
    for artist in (*axes.collections, *axes.images, *axes.lines, *axes.patches, *axes.texts):
        artist.remove()
    for axis, set_scale in ((axes.xaxis, axes.set_xscale), (axes.yaxis, axes.set_yscale)):
        if axis.get_scale() != "linear":
            set_scale("linear")
        axis.set_major_formatter(ScalarFormatter())
        axis.grid(True)
    for side in ("left", "bottom"):
        axes.spines[side].set_visible(True)
    axes.set_prop_cycle(None)
    axes.margins(0.05)
    axes.relim()
    axes.autoscale()
    return axes


def draw_steps(axes: Axes, values: Array, edges: Array, *, baseline: float, opacity: float) -> None:
    """Fill the steps between edges, shape (N + 1,), up to values, shape (N,).

    Limits do not follow them, as they do with `Axes.stairs`, which takes most of its time.
    """
    steps = StepPatch(values, edges, baseline=baseline, facecolor=COLOURS["data"], alpha=opacity, linewidth=0)
    axes.add_artist(steps)


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
    width, height = figure.bbox.size
    nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    figure.savefig(buffer, format="svg", metadata=nothing)
    drawing = buffer.getvalue()
    body = drawing[drawing.index("</defs>") + len("</defs>") :]  # the first defs is a style for the whole page
    head = f'<svg viewBox="0 0 {width:.0f} {height:.0f}" role="img" aria-label="{escape(label)}">'
    if axes not in _DRAWN:
        _DRAWN.append(axes)
    return Markup(head + frame(axes, height) + _slim(body, name))  # Matplotlib escapes the texts that it draws  # nosec B704


def _slim(body: str, name: str) -> str:
    """Keep what a browser needs: short numbers, ids that something refers to, the page's colours and font."""
    references = [identifier for tag in _TAG.findall(body) for identifier in _REFERENCE.findall(tag)]
    used = {identifier: f"{name}-{index}" for index, identifier in enumerate(dict.fromkeys(references))}

    def slim_tag(match: re.Match[str]) -> str:
        tag = _ID.sub(lambda found: f' id="{used[found[1]]}"' if found[1] in used else "", match[0])
        tag = _REFERENCE.sub(lambda found: found[0].replace(found[1], used[found[1]]), tag)
        tag = (_NEEDLESS_OF_SCALE if "matrix(" in tag else _NEEDLESS_DIGITS).sub("", tag)
        tag = _COLOUR.sub(lambda found: _VARIABLE[found[0]], _FONT.sub("", tag))
        return re.sub(r"\s*\n\s*", " ", tag)

    return re.sub(r">\s*\n\s*<", "><", _TAG.sub(slim_tag, body))  # between tags only: texts stay as they are
