"""Tables 6.1 and 6.2: all parameters of all leg joints, walking straight, and straight and sideways.

As in the paper, the logs have no noise. The study also shows the effect of two settings: a robust `loss`, and
`averaged_law`, which averages the law as the filter averages the acceleration.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from stribeck import Settings
from studies.markdown import markdown_table
from studies.paper import figures
from studies.paper.identified import JOINTS, PARAMETERS, identified, mean_and_worst, read_paper
from studies.paper.study import Numbers
from studies.paper.walks import get_walk

WALKS = ("straight", "straight-and-sideways")
PLAIN = "as `identify` comes"
FITS = {
    PLAIN: Settings(),
    "law averaged": Settings(averaged_law=True),
    "outliers heeded less": Settings(loss="huber"),
    "both": Settings(loss="huber", averaged_law=True),
}
QUICK_STRIDE = 4
"""Stride of the samples in the quick variant."""
SYMBOLS = {"Fv": "N m s/rad", "Fc": "N m", "S": "1", "vs": "rad/s", "offset": "N m", "a": "s/rad"}
"""Units of the parameters, by symbol."""
TITLES = ("viscous", "Coulomb", "Stribeck gain", "Stribeck velocity", "offset", "slope")


def run(quick: bool) -> Numbers:
    both = get_walk("straight-and-sideways", quick)
    settings = FITS
    if quick:  # a few steps are sufficient with short blocks
        both = replace(both, log=both.log.take(slice(None, None, QUICK_STRIDE)))
        settings = {name: each.model_copy(update={"block": 0.1}) for name, each in FITS.items()}
    fits = {name: identified(both, each) for name, each in settings.items()}
    # two straight steps determine no joint's friction
    ahead = fits["both"] if quick else identified(get_walk("straight"), settings["both"])
    return {
        "found": {"straight": ahead, "straight-and-sideways": fits["both"]},
        "truth": {joint: [both.truth.parameters[joint][name] for name in PARAMETERS] for joint in JOINTS},
        "fits": {name: mean_and_worst(rows) for name, rows in fits.items()},
    }


def drawings(numbers: Numbers) -> dict[str, Callable[[Figure], None]]:
    """Make the figure of the errors of Table 6.2."""
    return {"tables-errors": partial(_draw_errors, numbers=numbers)}


def _draw_errors(figure: Figure, numbers: Numbers) -> None:
    """Draw the error of each parameter of each joint in Table 6.2: the paper's, and ours with its interval."""
    figure.set_size_inches(figures.SIZE[0], 4.4)
    panels = figure.subplots(2, 3, sharex=True).ravel()
    paper, found = read_paper()["straight-and-sideways"], numbers["found"]["straight-and-sideways"]
    truth, places = numbers["truth"], np.arange(len(JOINTS))
    for k, axes in enumerate(panels):
        true = np.array([truth[joint][k] for joint in JOINTS])
        printed = 100 * (np.array([paper[joint]["found"][k] for joint in JOINTS]) / true - 1)
        error, width = ([found[joint][key][k] for joint in JOINTS] for key in ("error", "half_width"))
        axes.axhline(0, color=figures.ink(), lw=0.7)
        axes.plot(places - 0.15, printed, "o", color="C1", mfc="none", ms=4, label="the paper")
        bars = 100 * np.array(width) / true
        axes.errorbar(places + 0.15, error, bars, fmt="o", color="C0", ms=3, lw=1, label="here, with 95 % interval")
        axes.set_title(TITLES[k])
        labels = [f"{joint[0].upper()} {joint.split('_', 1)[1].replace('_', ' ')}" for joint in JOINTS]
        axes.set_xticks(places, labels, rotation=90, fontsize=6.5)
    for axes in panels[::3]:
        axes.set_ylabel("error [%]")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)


def texts(numbers: Numbers) -> dict[str, str]:
    """Format both tables, their means and worst errors, and the figures that the statements quote."""
    paper, fits, straight = read_paper(), numbers["fits"], numbers["found"]["straight"]
    weak = [joint for joint, row in straight.items() if np.any(row["weak"])]
    known = [row["error"][k] for row in straight.values() for k in (3, 4)]
    printed = mean_and_worst(paper["straight-and-sideways"])
    return {
        **{walk: _table(paper[walk], numbers["found"][walk]) for walk in WALKS},
        "weak": str(len(weak)),
        "weak-worst": f"{max(abs(straight[joint]['error'][0]) for joint in JOINTS):.0f} %",
        "straight-known": f"{max(map(abs, known)):.1f} %",
        "mean": _errors(fits["both"]["mean"]),
        "paper-mean": _errors(printed["mean"]),
        "plain-slope": f"{fits[PLAIN]['worst'][5]:.2g} %",
        "both-slope": f"{fits['both']['worst'][5]:.2g} %",
    }


def _errors(values: Iterable[float]) -> str:
    return ", ".join(f"{symbol} {value:.2g}" for symbol, value in zip(SYMBOLS, values, strict=True)) + " %"


def _table(paper: Numbers, found: Numbers) -> str:
    """Format one of the paper's tables with two rows per joint: the paper's and ours."""
    head = ("joint", "", *(f"{symbol} [{unit}]" for symbol, unit in SYMBOLS.items()))
    rows: list[tuple[str, ...]] = []
    for joint, row in found.items():
        name, printed = joint.replace("_", " "), paper[joint]
        cells = [
            f"{value:.4g}<br>{error:.2f} %" for value, error in zip(printed["found"], printed["error"], strict=True)
        ]
        rows.append((name, "paper", *cells))
        ours = zip(row["value"], row["half_width"], row["error"], row["weak"], strict=True)
        rows.append((f"**{row['verdict']}**", "here", *(_cell(*each) for each in ours)))
    return markdown_table(head, rows)


def _cell(value: float, half_width: float, error: float, weak: float) -> str:
    if np.isnan(value):
        return "–"
    size = f"{abs(error):.2f} %"
    return f"{value:.4g} ± {half_width:.1g}<br>{f'*{size}, weak*' if weak else size}"
