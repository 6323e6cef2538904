"""Timeline of contact modes and their used parts."""

import numpy as np

from stribeck.app.report.charts import Chart, axis, line
from stribeck.app.report.page import Section, section
from stribeck.core.base.typing import Array

Phases = list[tuple[float, float, str, bool]]


def timeline(recorded: Phases, usage: str = "") -> Section | None:
    """Render the timeline and the time in each mode; None without time.

    Parameters
    ----------
    recorded
        Start [s], end [s], contact mode, whether it is used; in log order.
    usage
        Phrase on the samples whose friction torque is known.
    """
    phases = one_clock(recorded)
    start, end = (phases[0][0], max(phase[1] for phase in phases)) if phases else (0.0, 0.0)
    if end <= start:
        return None
    names = list(dict.fromkeys(phase[2] for phase in phases))
    figures = {"p0": (_strips(phases, names, start, end), "Whole log")}
    spans = {name: [(phase[1] - phase[0], phase[3]) for phase in phases if phase[2] == name] for name in names}
    rows = {key: ([span for span, _ in pairs], [span for span, used in pairs if used]) for key, pairs in spans.items()}
    about = {"several": phases != recorded, "usage": usage[:1].upper() + usage[1:]}
    return section("timeline", "Contact modes over time", "timeline", figures, rows=rows, **about)


def one_clock(phases: Phases) -> Phases:
    """Concatenate phases of several logs; a new log starts where the time decreases."""
    placed: Phases = []
    shift, previous, last = 0.0, -np.inf, 0.0
    for start, end, name, used in phases:
        if start < previous:
            shift = last - start
        placed.append((start + shift, end + shift, name, used))
        previous, last = start, max(last, end + shift)
    return placed


def _strips(phases: Phases, names: list[str], start: float, end: float) -> Chart:
    visible = [phase for phase in phases if phase[1] > start and phase[0] < end]
    edges = np.linspace(start, end, 601)
    if len(visible) <= 250:  # few enough to be drawn exactly instead of as shares of 600 steps
        borders = np.clip([phase[:2] for phase in visible], start, end).ravel()
        edges = np.unique(np.round([start, *borders, end], 6))
    lines = []
    for row, name in enumerate(reversed(names)):
        for used, opacity in ((False, 0.3), (True, 0.9)):
            chosen = [phase for phase in visible if phase[2] == name and (phase[3] or not used)]
            top = row - 0.3 + 0.6 * np.append(share_held(chosen, edges), 0.0)
            label = name if used else ""
            lines.append(line(edges, top, "data", label, steps=True, base=row - 0.3, opacity=opacity, width=0))
    limits = (-0.5, len(names) - 0.5)
    x, y = axis("time [s]", (start, end)), axis("", limits, names=names[::-1])
    return {"x": x, "y": y, "lines": lines, "height": 60 + 34 * len(names)}


def share_held(phases: Phases, edges: Array) -> Array:
    """Compute the share of each step between edges that the phases fill, shape (k,)."""
    if not phases:
        return np.zeros(len(edges) - 1)
    times = np.array([phase[:2] for phase in phases]).ravel()
    held = np.repeat(np.cumsum([phase[1] - phase[0] for phase in phases]), 2)
    held[::2] = np.concatenate([[0.0], held[1:-1:2]])  # total duration of the earlier phases at each start
    return np.asarray(np.diff(np.interp(edges, times, held)) / np.diff(edges))
