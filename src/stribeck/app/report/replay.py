"""Page and recording of `stribeck replay`: errors per joint and model, and torques and positions over time."""

from collections.abc import Mapping, Sequence
from itertools import zip_longest
from pathlib import Path, PurePath

import numpy as np

from stribeck.app.report.charts import Chart, axis, line
from stribeck.app.report.page import Section, render, section, write_page
from stribeck.app.report.recording import Curves
from stribeck.app.report.text import number
from stribeck.app.report.torques import POINTS, over_time
from stribeck.core.base.typing import Array
from stribeck.design import Replay

Values = Sequence[Sequence[float | None]]
"""Values by model and joint."""

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
    times = [f"{1e3 * horizon:.0f}" for horizon in replay.horizons]
    errors: dict[str, Values] = {
        f"velocity error after {time} ms": [
            [rollout.relative if (rollout := run[k]) else None for run in row] for row in runs
        ]
        for k, time in enumerate(times)
    }
    tables = [
        _errors(
            replay.joints,
            "Torque not explained by inverse dynamics",
            "R² of the measured torque (RMS error in N m, N); motion and torque pass the same filter.",
            {"1 − R²": [[1 - error.r2 if error else None for error in row] for row in torque]},
            [[f"{error.r2:.3f} ({error.rms:.3g})" if error else "–" for error in row] for row in torque],
            legend,
        ),
        _errors(
            replay.joints,
            "Velocity error of short simulations",
            "RMS error of the velocity divided by the RMS change of the measured velocity; above 1, a model is worse "
            f"than a constant velocity. After {', '.join(times)} ms.",
            errors,
            [[", ".join(f"{e.relative:.3g}" if e else "–" for e in run) for run in row] for row in runs],
            legend,
        ),
    ]
    sections = [part for pair in zip_longest(tables, _motion_sections(replay, legend)) for part in pair]
    lead = render("replay_heading.html.j2", replay=replay, log=PurePath(replay.log).name or "log in memory")
    write_page(path, f"{replay.robot}: a log replayed", sections, lead=lead)


def _errors(
    joints: list[str], title: str, caption: str, shown: Mapping[str, Values], cells: list[list[str]], legend: Legend
) -> Section:
    """Render charts and a table of values by model and joint."""
    anchor = title.partition(" ")[0].lower()
    figures = {f"{anchor}{k}": (_chart(joints, *entry, legend), entry[0]) for k, entry in enumerate(shown.items())}
    rows = list(zip(joints, zip(*cells, strict=True), strict=True))
    return section(anchor, title, "replay", figures, caption=caption, legend=legend, rows=rows)


def _chart(joints: list[str], label: str, values: Values, legend: Legend) -> Chart:
    """Draw one dot per joint and model on a logarithmic axis."""
    shown = np.array(values, dtype=float)  # NaN for None
    shown[~(shown > 0)] = np.nan
    seen = shown[np.isfinite(shown)].tolist() or [0.1, 1.0]
    return {
        "x": axis("", (-0.5, len(joints) - 0.5), names=joints),
        "y": axis(label, (0.7 * min(seen), 1.4 * max(seen)), log=True),
        "lines": [line(range(len(joints)), row, *key, points=8) for row, key in zip(shown, legend, strict=True)],
        "height": 320,
    }


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
        _over_log("Torque over the log", "", motion.torque_time, torques, legend),
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
    anchor = title.partition(" ")[0].lower() + "-over-log"
    figures = {
        f"{anchor}{k}": (over_time(time - time[0], label, values, legend, POINTS // len(drawn), anchor), caption)
        for k, (caption, (label, values)) in enumerate(drawn.items())
    }
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
