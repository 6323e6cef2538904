"""Figures for print and screen: one style, a light and a dark file each, reproducible to the byte."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib as mpl
from cycler import cycler
from matplotlib import style
from matplotlib.figure import Figure

from studies.paper.study import ROOT

FOLDER = ROOT / "docs" / "assets" / "paper"
SIZE = (6.5, 2.8)
"""Default size of a figure [inch]; as wide as the text on a printed page."""
LARGEST = 200_000
"""Maximum file size of a figure [bytes]."""

_THEMES = {
    "light": {
        "ink": "#1f2328",
        "grid": "#d8dee4",
        "cycle": ["#1868b7", "#d1570a", "#0b7f5c", "#8250c4", "#b3446c", "#6e7781"],
    },
    "dark": {
        "ink": "#e6edf3",
        "grid": "#3a424c",
        "cycle": ["#6cb2f7", "#ffa056", "#4fcfa3", "#c5a0f5", "#f08fb4", "#9aa4ae"],
    },
}
_STYLE = Path(__file__).with_name("figures.mplstyle")


def ink() -> str:
    """Return the color of text, which the ground truth is drawn in."""
    return str(mpl.rcParams["text.color"])


def save(name: str, draw: Callable[[Figure], None], folder: Path = FOLDER) -> None:
    """Draw a figure in each theme and write `<name>-<theme>.svg`.

    Raises
    ------
    ValueError
        If a file is larger than `LARGEST`: too many points for a page.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for theme in _THEMES:
        with style.context([_STYLE, _colours(theme)], after_reset=True):
            figure = Figure(figsize=SIZE, layout="constrained")
            draw(figure)
            path = folder / f"{name}-{theme}.svg"
            figure.savefig(path, metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
        if path.stat().st_size > LARGEST:
            raise ValueError(f"{path.name}: has {path.stat().st_size} bytes; draw fewer points")


def _colours(theme: str) -> dict[str, Any]:
    colours = _THEMES[theme]
    inked = ("text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color")
    return dict.fromkeys(inked, colours["ink"]) | {
        "grid.color": colours["grid"],
        "axes.prop_cycle": cycler(color=colours["cycle"]),
    }
