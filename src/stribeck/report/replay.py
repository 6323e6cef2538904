"""Page of `stribeck replay`: errors of torques and rollouts per joint, with one color per model."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

import numpy as np

from stribeck.report.charts import Chart, axis, line
from stribeck.report.page import Section, render, write_page
from stribeck.report.replay_motion import motion_sections

if TYPE_CHECKING:  # only for types: replay is above this room
    from stribeck.replay.comparison import Replay

COLOURS = ("muted", "ink", "data", "law")
"""Colors of the robot's own model without and with friction, and of the other model without and with friction."""

Values = Sequence[Sequence[float | None]]
"""Values by model and joint."""


def write_replay(replay: Replay, path: str | Path) -> None:
    """Write a replay as one self-contained HTML file, completely or not at all."""
    torque = [[model.torque.get(joint) for joint in replay.joints] for model in replay.models]
    none = [None] * len(replay.horizons)
    runs = [[model.rollouts.get(joint) or none for joint in replay.joints] for model in replay.models]
    times = [f"{1e3 * horizon:.0f}" for horizon in replay.horizons]
    errors = [
        (
            f"velocity error after {time} ms",
            [[each.relative if (each := run[k]) else None for run in own] for own in runs],
        )
        for k, time in enumerate(times)
    ]
    tables = [
        _section(
            replay,
            "Torque not explained by inverse dynamics",
            "R² of the measured torque (RMS error in N m, N); motion and torque pass the same filter.",
            [("1 − R²", [[1 - error.r2 if error else None for error in own] for own in torque])],
            [[f"{error.r2:.3f} ({error.rms:.3g})" if error else "–" for error in own] for own in torque],
        ),
        _section(
            replay,
            "Velocity error of short simulations",
            "RMS error of the velocity divided by the RMS change of the measured velocity; above 1, a model is worse "
            f"than a constant velocity. After {', '.join(times)} ms.",
            errors,
            [[", ".join(f"{e.relative:.3g}" if e else "–" for e in run) for run in own] for own in runs],
        ),
    ]
    pictures = motion_sections(replay, _colours(replay))
    sections = [each for pair in zip_longest(tables, pictures) for each in pair]
    lead = render("replay_heading.html.j2", replay=replay, log=PurePath(replay.log).name or "log in memory")
    write_page(path, f"{replay.robot}: a log replayed", sections, lead=lead)


def _colours(replay: Replay) -> list[str]:
    """Select the color of each model; the second one has friction if it is the robot's own."""
    own = replay.models[1].friction
    return [colour for colour in COLOURS if own or colour != COLOURS[1]][: len(replay.models)]


def _section(
    replay: Replay, title: str, caption: str, shown: Sequence[tuple[str, Values]], cells: list[list[str]]
) -> Section:
    """Render charts and a table of values by model and joint."""
    anchor = title.partition(" ")[0].lower()
    charts = {f"{anchor}{k}": _chart(replay, label, values) for k, (label, values) in enumerate(shown)}
    body = render(
        "replay.html.j2",
        caption=caption,
        legend=[(colour, model.name) for colour, model in zip(_colours(replay), replay.models, strict=False)],
        figures=[(name, label) for name, (label, _) in zip(charts, shown, strict=True)],
        rows=list(zip(replay.joints, zip(*cells, strict=True), strict=True)),
    )
    return Section(anchor=anchor, title=title, body=body, charts=charts)


def _chart(replay: Replay, label: str, values: Values) -> Chart:
    """Draw one dot per joint and model on a logarithmic axis."""
    joints = replay.joints
    lines = []
    for own, colour, model in zip(values, _colours(replay), replay.models, strict=False):
        shown = [found if found and found > 0 else np.nan for found in own]
        lines.append(line(range(len(joints)), shown, colour, model.name, points=8))
    seen = [found for own in values for found in own if found and found > 0] or [0.1, 1.0]
    y = axis(label, (0.7 * min(seen), 1.4 * max(seen)), log=True)
    return {"x": axis("", (-0.5, len(joints) - 0.5), names=joints), "y": y, "lines": lines, "height": 320}
