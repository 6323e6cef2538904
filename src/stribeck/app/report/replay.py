"""Page and recording of `stribeck replay`: errors per joint and model, and torques and positions over time."""

from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path, PurePath

import numpy as np

from stribeck.app.report.charts import Figures, over_time, with_residual
from stribeck.app.report.page import Section, render, section, write_page
from stribeck.app.report.recording import Curves
from stribeck.app.report.text import number, share
from stribeck.app.report.torques import POINTS
from stribeck.core.base.typing import Array
from stribeck.design import Replay

Legend = Sequence[tuple[str, str]]
"""Color and label of each line."""

Drawn = dict[str, tuple[str, list[Array]]]
"""Label of the vertical axis, then the measured values and the values of both models, by caption."""


def write_replay(replay: Replay, path: str | Path) -> None:
    """Write a replay as one self-contained HTML file, completely or not at all."""
    # the robot's own model and the other model, each without and with friction
    colours = ["muted", *(["ink"] if replay.models[1].friction else []), "data", "law"]
    legend = list(zip(colours, (model.name for model in replay.models), strict=False))
    torque = [[model.torque.get(joint) for joint in replay.joints] for model in replay.models]
    none = [None] * len(replay.horizons)
    runs = [[model.rollouts.get(joint) or none for joint in replay.joints] for model in replay.models]
    times = ", ".join(f"{1e3 * horizon:.0f}" for horizon in replay.horizons)
    tables = [
        _table(
            replay.joints,
            "Torque error of inverse dynamics",
            "RMS error in N m, N (R² of the measured torque); motion and torque pass the same filter.",
            [[f"{number(error.rms)} ({share(error.r2, 2)})" if error else "–" for error in row] for row in torque],
            legend,
        ),
        _table(
            replay.joints,
            "Velocity error of short simulations",
            f"RMS error of the velocity after {times} ms, divided by the RMS change of the measured velocity; above 1, "
            "a model is worse than a constant velocity.",
            [[", ".join(number(e.relative) if e else "–" for e in run) for run in row] for row in runs],
            legend,
        ),
    ]
    sections = [part for pair in zip_longest(_motion_sections(replay, legend), tables) for part in pair]
    lead = render("replay_heading.html.j2", replay=replay, log=PurePath(replay.log).name or "log in memory")
    write_page(path, f"{replay.robot}: a log replayed", sections, lead=lead)


def _table(joints: list[str], title: str, caption: str, cells: list[list[str]], legend: Legend) -> Section:
    """Render a table of values by model and joint."""
    rows = list(zip(joints, zip(*cells, strict=True), strict=True))
    anchor = title.partition(" ")[0].lower()
    return section(anchor, title, "replay", caption=caption, legend=legend, rows=rows)


def _motion_sections(replay: Replay, legend: Legend) -> list[Section | None]:
    """Render a section of torques and one of positions, None if unknown; an empty list without motion.

    `legend` has one color per model of the replay.
    """
    motion = replay.motion
    chosen = [-2, -1] if replay.models[-1].friction else [0, -1]  # without friction, and the unchanged other model
    models, legend = [replay.models[k] for k in chosen], [("ink", "measured"), *(legend[k] for k in chosen)]
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
    about = "under the measured torque or the commands; each starts at the measured position and velocity."
    about = f"Simulations of {1e3 * replay.horizons[-1]:.0f} ms {about}"
    return [
        _over_log(
            "Torque over the log",
            "Two charts per joint: torques, and measured torque minus the torque of each model.",
            motion.torque_time,
            torques,
            legend,
        ),
        _over_log("Position of short simulations", about, time, positions, legend),
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
    series, duration, free = np.full(len(time), np.nan), replay.horizons[-1], -np.inf
    offsets = np.linspace(0.0, duration, position.shape[1], endpoint=False)
    for row in np.argsort(start):
        if start[row] < free or np.isnan(position[row]).all():
            continue
        free = start[row] + 1.1 * duration  # with a pause between two simulations
        inside = slice(*np.searchsorted(time, [start[row], start[row] + offsets[-1]]))
        series[inside] = np.interp(time[inside] - start[row], offsets, position[row])
    return series


def _over_log(title: str, about: str, time: Array, drawn: Drawn, legend: Legend) -> Section | None:
    """Render one chart per joint; all charts of a section zoom together."""
    anchor, points = title.partition(" ")[0].lower() + "-over-log", POINTS // max(len(drawn), 1)
    figures: Figures = {}
    for k, (caption, (label, values)) in enumerate(drawn.items()):
        key, chart = f"{anchor}{k}", over_time(time - time[0], label, values, legend, points, anchor)
        pair = with_residual(key, caption, chart, values, np.isfinite(values[0])) if label.startswith("torque") else {}
        figures |= pair or {key: (chart, caption)}
    return section(anchor, title, "torques", figures, legend=legend, about=about) if figures else None


def curves_of_replay(replay: Replay) -> Curves:
    """Collect measured and predicted torque, and measured and simulated position of each joint."""
    motion, curves = replay.motion, {}
    assert motion is not None  # of a replay
    torque_time, time = motion.torque_time - motion.position_time[0], motion.position_time - motion.position_time[0]
    for name in replay.joints:
        if name in motion.torque:
            curves[name, "torque", "measured"] = torque_time, motion.torque[name]
        curves[name, "position", "measured"] = time, motion.position[name]
        for model in replay.models:
            if name in model.predicted:
                curves[name, "torque", model.name] = torque_time, model.predicted[name]
            if name in model.positions:
                shown = pieces(motion.position_time, *model.positions[name], replay)
                curves[name, "position", model.name] = time, shown
    return curves
