"""The page of `stribeck replay`: errors of torques and rollouts, joint by joint, a colour a model."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

from stribeck.report.charts import Chart, axis, line
from stribeck.report.page import Section, render, write_page

if TYPE_CHECKING:  # the report stands below what replays a log, and is given what was found
    from stribeck.replay.replay import Replay, Replayed

COLOURS = ("muted", "ink", "data", "law")
"""Of the models in their order; the robot's own are grey and black."""


def write_replay(replay: Replay, path: str | Path) -> None:
    """Write how a log compares with the models as one self-contained HTML file, whole or not at all."""
    lead = render("replay_heading.html.j2", replay=replay, log=PurePath(replay.log).name or "log made in memory")
    torque = _chart(
        replay, "1 − R²", lambda model, joint: 1 - model.torque[joint].r2 if joint in model.torque else None
    )
    errors = [
        _chart(replay, "relative velocity error", lambda model, joint, k=k: _relative(model, joint, k))  # type: ignore[misc]
        for k in range(len(replay.horizons))
    ]
    times = [f"{1e3 * horizon:.0f}" for horizon in replay.horizons]
    sections = [
        _section(
            replay,
            "Torque that inverse dynamics leave unexplained",
            "R² of the measured torque (RMS error in N m, N); motion and torque have passed the same filter.",
            [(torque, "1 − R²")],
            lambda model, joint: (
                f"{model.torque[joint].r2:.3f} ({model.torque[joint].rms:.3g})" if joint in model.torque else "–"
            ),
        ),
        _section(
            replay,
            "Velocity error of short simulations",
            "RMS error of the velocity over the RMS change of the measured one; at 1 a model says as much as that "
            f"nothing changes. {', '.join(times)} ms.",
            [(chart, f"velocity error after {time} ms") for chart, time in zip(errors, times, strict=True)],
            lambda model, joint: (
                ", ".join(f"{error.relative:.3g}" if error else "–" for error in model.rollouts.get(joint, [])) or "–"
            ),
        ),
    ]
    write_page(path, f"{replay.robot}: a log replayed", sections, lead=lead)


def _relative(model: Replayed, joint: str, horizon: int) -> float | None:
    error = model.rollouts[joint][horizon] if joint in model.rollouts else None
    return error.relative if error else None


def _section(
    replay: Replay,
    title: str,
    caption: str,
    charts: list[tuple[Chart, str]],
    cell: Callable[[Replayed, str], str],
) -> Section:
    """Return a section with charts of values by model and joint, and a table of the same."""
    anchor = title.partition(" ")[0].lower()
    body = render(
        "replay.html.j2",
        caption=caption,
        legend=list(zip(COLOURS, [model.name for model in replay.models], strict=False)),
        figures=[(f"{anchor}{k}", label) for k, (_, label) in enumerate(charts)],
        rows=[(joint, [cell(model, joint) for model in replay.models]) for joint in replay.joints],
    )
    return Section(
        anchor=anchor, title=title, body=body, charts={f"{anchor}{k}": chart for k, (chart, _) in enumerate(charts)}
    )


def _chart(replay: Replay, label: str, value: Callable[[Replayed, str], float | None]) -> Chart:
    """Return a chart with a dot per joint and model, on a logarithmic axis."""
    lines = []
    for colour, model in zip(COLOURS, replay.models, strict=False):
        shown = [(k, found) for k, joint in enumerate(replay.joints) if (found := value(model, joint)) and found > 0]
        lines.append(line([k for k, _ in shown], [found for _, found in shown], colour, model.name, points=8))
    values = [found for each in lines for found in each["y"] if found] or [0.1, 1.0]
    x = axis("", (-0.5, len(replay.joints) - 0.5), names=replay.joints)
    return {"x": x, "y": axis(label, (0.7 * min(values), 1.4 * max(values)), log=True), "lines": lines, "height": 320}
