"""Torques and positions of a replay over the log: measured, without and with the friction of the other model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from stribeck.base.typing import Array
from stribeck.report.charts import axis, robust_limits
from stribeck.report.page import Section, render
from stribeck.report.text import number
from stribeck.report.torques import POINTS, over_time

if TYPE_CHECKING:  # only for types: replay is above this room
    from stribeck.replay.comparison import Replay

Drawn = dict[str, tuple[str, list[Array]]]
"""Label of the vertical axis, then the measured values and the values of both models, by caption."""


def motion_sections(replay: Replay, colours: Sequence[str]) -> list[Section | None]:
    """Render a section of torques and one of positions, None if unknown; an empty list without motion.

    `colours` has one color per model of the replay.
    """
    motion = replay.motion
    chosen = [-2, -1] if replay.models[-1].friction else [0, -1]  # without friction, and the unchanged other model
    models, colours = [replay.models[k] for k in chosen], [colours[k] for k in chosen]
    if motion is None or min(len(motion.torque_time), len(motion.position_time)) < 2:
        return []
    torques: Drawn = {
        f"{joint}: error {' → '.join(number(model.torque[joint].rms, 2) for model in models)} (RMS)": (
            f"torque [{'N' if joint in motion.prismatic else 'N m'}]",
            [motion.torque[joint], *(model.predicted[joint] for model in models)],
        )
        for joint in replay.joints
        if all(joint in model.torque for model in models)
    }
    time = motion.position_time
    positions: Drawn = {
        joint: (
            f"position [{'m' if joint in motion.prismatic else 'rad'}]",
            [motion.position[joint], *(pieces(time, *model.positions[joint], replay) for model in models)],
        )
        for joint in replay.joints
        if all(joint in model.positions for model in models)
    }
    legend = [("ink", "measured"), *((own, model.name) for own, model in zip(colours, models, strict=True))]
    about = "under the measured torque; each starts at the measured position and velocity."
    about = f"Simulations of {1e3 * replay.horizons[-1]:.0f} ms {about}"
    return [
        _section("Torque over the log", "", motion.torque_time, torques, legend),
        _section("Position of short simulations", about, time, positions, legend),
    ]


def pieces(time: Array, start: Array, position: Array, replay: Replay) -> Array:
    """Interpolate simulations that do not overlap at the times of the log, shape (T,); NaN between them.

    Parameters
    ----------
    time
        Times of the log [s], shape (T,).
    start, position
        Start times [s], shape (S,), and positions at even times up to the last horizon, shape (S, K).
    replay
        Replay with the horizons.
    """
    found, duration, free = np.full(len(time), np.nan), replay.horizons[-1], -np.inf
    offsets = np.linspace(0.0, duration, position.shape[1], endpoint=False)
    for row in np.argsort(start):
        if start[row] < free or np.isnan(position[row]).all():
            continue
        free = start[row] + 1.1 * duration  # with a pause between two simulations
        inside = slice(*np.searchsorted(time, [start[row], start[row] + offsets[-1]]))
        found[inside] = np.interp(time[inside] - start[row], offsets, position[row])
    return found


def _section(title: str, about: str, time: Array, drawn: Drawn, legend: Sequence[tuple[str, str]]) -> Section | None:
    """Render one chart per joint; all charts of a section zoom together."""
    anchor = title.partition(" ")[0].lower() + "-over-log"
    elapsed, charts = time - time[0], {}
    for k, (label, values) in enumerate(drawn.values()):
        curves = [(own, *key) for own, key in zip(values, legend, strict=True)]
        charts[f"{anchor}{k}"] = {
            "x": axis("time [s]", (0.0, float(elapsed[-1]))),
            "y": axis(label, robust_limits(values[0][np.isfinite(values[0])], share=0.0)),
            "lines": over_time(elapsed, curves, POINTS // len(drawn)),
            "sync": anchor,
        }
    figures = list(zip(charts, drawn, strict=True))
    body = render("torques.html.j2", legend=legend, about=about, figures=figures)
    return Section(anchor=anchor, title=title, body=body, charts=charts) if figures else None
