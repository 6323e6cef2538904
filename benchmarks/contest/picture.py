"""Draw the errors of the friction curves per method and condition for docs/accuracy.md.

python -m benchmarks.contest picture benchmarks/contest/scores.json docs/assets/benchmark.svg
"""

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from benchmarks.contest.cases import CONDITIONS, LATENCIES
from benchmarks.contest.score import Score
from benchmarks.contest.table import GROUPS, median_curve, names

INK, PALE, GRID = "#22262b", "#6b7280", "#e3e6ea"
SHOWN = (*CONDITIONS, *LATENCIES)
MARKS = dict(zip(SHOWN, "osD^v<PXh", strict=True))
HUES = ("#1b7837", "#2166ac", "#d6604d", "#b35806", "#762a83", "#e08214", "#b2182b", "#35978f", "#01665e")
COLOURS = dict(zip(SHOWN, HUES, strict=True))
LEAST, MOST = 1e-4, 3.0
"""Limits of the axis [1]; values outside are drawn at the limits."""
ROW = 0.34
"""Height of a row [inch]."""


def draw(scores: Sequence[Score], path: Path) -> None:
    """Write the picture, in SVG."""
    rows = {group: found for group in GROUPS if (found := _rows(scores, group))}
    heights = [len(found) for found in rows.values()]
    mpl.rcParams.update({"svg.hashsalt": "benchmark", "svg.fonttype": "none", "font.family": "sans-serif"})
    figure = Figure(figsize=(9.0, ROW * (sum(heights) + 3 * len(rows)) + 0.9), layout="constrained")
    axes = figure.subplots(len(rows), 1, sharex=True, squeeze=False, gridspec_kw={"height_ratios": heights})[:, 0]
    for axis, (group, found) in zip(axes, rows.items(), strict=True):
        for place, (_, errors) in enumerate(found):
            values = [min(max(value, LEAST), MOST) for value in errors.values()]
            axis.plot([min(values), max(values)], [place, place], color=GRID, lw=6, solid_capstyle="round", zorder=1)
            for condition, value in zip(errors, values, strict=True):
                mark = {"color": COLOURS[condition], "ms": 7, "mec": "white", "mew": 0.6, "clip_on": False, "zorder": 3}
                axis.plot(value, place, MARKS[condition], **mark)
        axis.set_yticks(range(len(found)), [name for name, _ in found], color=INK, fontsize=10)
        axis.set_ylim(len(found) - 0.4, -0.6)
        axis.set_title(group, loc="left", color=INK, fontsize=11, fontweight="bold")
        axis.set_xscale("log")
        axis.set_xlim(LEAST, MOST)
        axis.grid(axis="x", color=GRID, lw=0.8)
        axis.tick_params(length=0, colors=PALE)
        axis.tick_params(axis="y", colors=INK)
        for side in axis.spines.values():
            side.set_visible(False)
    axes[-1].set_xticks([1e-4, 1e-3, 1e-2, 1e-1, 1.0], ["0.01 %", "0.1 %", "1 %", "10 %", "100 %"])
    axes[-1].minorticks_off()
    axes[-1].set_xlabel(
        "error of the friction curve, median over joints (farther left is better)", color=PALE, fontsize=10
    )
    handles = [Line2D([], [], ls="", marker=MARKS[name], color=COLOURS[name], ms=7, label=name) for name in SHOWN]
    figure.legend(
        handles=handles, loc="outside upper center", ncols=len(SHOWN), frameon=False, fontsize=9, handletextpad=0.2
    )
    figure.savefig(path, format="svg", metadata={"Date": None}, transparent=False)


def _rows(scores: Sequence[Score], group: str) -> list[tuple[str, dict[str, float]]]:
    """Compute the median errors of each contestant, by condition."""
    found = []
    for name in names(scores):
        own = [each for each in scores if each.contestant == name and each.robot in GROUPS[group]]
        errors = {condition: value for condition in SHOWN if (value := median_curve(own, condition)) is not None}
        if errors:
            found.append((name, errors))
    return found
