"""The timeline of contact modes: which feet stood when, and which of that time was used."""

import numpy as np
from matplotlib.axes import Axes

from stribeck.report.figure import COLOURS, draw_steps, inline_svg, new_axes
from stribeck.report.page import Section, render
from stribeck.typing import Array

COLUMNS = 600
"""Steps across the figure; a step is drawn as high as the share of its time that the contact mode has."""

MOST_EXACT = 250
"""Phases up to which a figure shows their very borders instead of shares."""

CLOSE_UP = 12.0
"""Length of the close-up beside a long log [s]."""

ROW_HEIGHT = 32.0
"""Height of a contact mode's strip with its name [SVG units]."""

BAR = 0.54
"""Share of a row that its strip takes; above it is the name."""

Phases = list[tuple[float, float, str, bool]]


def timeline(recorded: Phases, clear: float | None = None) -> Section | None:
    """Return the section with the timeline, a close-up of a long log, and the time of each mode; None without time.

    Parameters
    ----------
    recorded
        Start [s], end [s], contact mode, whether it is used; in log order.
    clear
        Where the close-up of the joints' panels begins [s]: this close-up shows it.
    """
    phases = one_clock(recorded)
    start, end = (phases[0][0], max(phase[1] for phase in phases)) if phases else (0.0, 0.0)
    if end <= start:
        return None
    names = list(dict.fromkeys(phase[2] for phase in phases))
    figures = [(inline_svg(_strips(phases, names, start, end), "Contact modes over the whole log", "p0"), "Whole log")]
    if end - start > 2 * CLOSE_UP:
        near = min(max(start if clear is None else clear - 1.0, start), end - CLOSE_UP)
        drawing = inline_svg(_strips(phases, names, near, near + CLOSE_UP), "Contact modes, close-up", "p1")
        figures.append((drawing, f"Close-up of {CLOSE_UP:.0f} s"))
    rows = [
        {
            "name": name,
            "count": sum(phase[2] == name for phase in phases),
            "time": sum(phase[1] - phase[0] for phase in phases if phase[2] == name),
            "used": sum(phase[1] - phase[0] for phase in phases if phase[2] == name and phase[3]),
        }
        for name in names
    ]
    body = render("timeline.html.j2", figures=figures, rows=rows, several=phases != recorded)
    return Section(anchor="timeline", title="Contact modes over time", body=body)


def one_clock(phases: Phases) -> Phases:
    """Return phases of several logs one after the other; a new log is where the time steps back."""
    placed: Phases = []
    shift, previous, last = 0.0, -np.inf, 0.0
    for start, end, name, used in phases:
        if start < previous:
            shift = last - start
        placed.append((start + shift, end + shift, name, used))
        previous, last = start, max(last, end + shift)
    return placed


def _strips(phases: Phases, names: list[str], start: float, end: float) -> Axes:
    visible = [phase for phase in phases if phase[1] > start and phase[0] < end]
    axes = new_axes("time [s]", "", height=40.0 + ROW_HEIGHT * len(names), left=8.0)
    edges = np.linspace(start, end, COLUMNS + 1)
    if len(visible) <= MOST_EXACT:  # few enough to be drawn with their very borders
        edges = np.unique(np.round([*edges, *np.clip([phase[:2] for phase in visible], start, end).ravel()], 6))
    for row, name in enumerate(reversed(names)):
        for used, opacity in ((False, 0.3), (True, 0.9)):
            chosen = [phase for phase in visible if phase[2] == name and (phase[3] or not used)]
            share = _share_held(chosen, edges)
            draw_steps(axes, row + BAR * share, edges, baseline=row, opacity=opacity)
        axes.text(start, row + BAR + 0.13, name, color=COLOURS["ink"], fontsize=9, parse_math=False)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.set_xlim(start, end)
    axes.set_ylim(-0.05, len(names))
    return axes


def _share_held(phases: Phases, edges: Array) -> Array:
    """Return the share of each step between edges, shape (k,), that the phases fill."""
    if not phases:
        return np.zeros(len(edges) - 1)
    times = np.array([phase[:2] for phase in phases]).ravel()
    held = np.repeat(np.cumsum([phase[1] - phase[0] for phase in phases]), 2)
    held[::2] = np.concatenate([[0.0], held[1:-1:2]])  # at each phase's start: what the earlier ones held
    return np.asarray(np.diff(np.interp(edges, times, held)) / np.diff(edges))
