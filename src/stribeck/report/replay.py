"""The page of `stribeck replay`: errors of torques and rollouts, joint by joint, a colour a model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

from markupsafe import Markup
from matplotlib.ticker import FuncFormatter

from stribeck.outputs import whole_or_not_at_all
from stribeck.report.figure import COLOURS, house_style, inline_svg, new_axes
from stribeck.report.page import Section, render, render_page

if TYPE_CHECKING:  # the report stands below what replays a log, and is given what was found
    from stribeck.replay.replay import Replay

MODEL_COLOURS = ("muted", "ink", "data", "law")
"""Of the models in their order; the robot's own are grey and black."""

ROW, AROUND, LETTER = 15.0, 44.0, 6.0
"""Height of a joint in a figure, of what is above and below all of them, and width of a letter [SVG units]."""


def write_replay(replay: Replay, path: str | Path) -> None:
    """Write how a log compares with the models as one self-contained HTML file, whole or not at all."""
    with house_style():
        page = render_page(
            f"{replay.robot}: a log replayed",
            [_torque(replay), _rollouts(replay)],
            lead=render("replay_heading.html.j2", replay=replay, log=PurePath(replay.log).name or "log made in memory"),
        )
    with whole_or_not_at_all(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def _torque(replay: Replay) -> Section:
    left = [{joint: 1 - error.r2 for joint, error in model.torque.items()} for model in replay.models]
    return _section(
        replay,
        title="Torque that inverse dynamics leave unexplained",
        caption="R² of the measured torque (RMS error in N m, N); motion and torque have passed the same filter.",
        figures=[(left, "1 − R²")],
        cells=[
            {joint: f"{error.r2:.3f} ({error.rms:.3g})" for joint, error in model.torque.items()}
            for model in replay.models
        ],
    )


def _rollouts(replay: Replay) -> Section:
    figures = []
    for k, horizon in enumerate(replay.horizons):
        values = [
            {joint: error.relative for joint, errors in model.rollouts.items() if (error := errors[k])}
            for model in replay.models
        ]
        figures.append((values, f"velocity error after {1e3 * horizon:.0f} ms"))
    return _section(
        replay,
        title="Velocity error of short simulations",
        caption="RMS error of the velocity over the RMS change of the measured one; at 1 a model says as much as that "
        "nothing changes. " + ", ".join(f"{1e3 * horizon:.0f}" for horizon in replay.horizons) + " ms.",
        figures=figures,
        cells=[
            {
                joint: ", ".join(f"{error.relative:.3g}" if error else "–" for error in errors)
                for joint, errors in model.rollouts.items()
            }
            for model in replay.models
        ],
    )


def _section(
    replay: Replay,
    *,
    title: str,
    caption: str,
    figures: Sequence[tuple[Sequence[Mapping[str, float]], str]],
    cells: Sequence[Mapping[str, str]],
) -> Section:
    """Return a section with figures of values by model and joint, and a table of the same."""
    anchor = title.partition(" ")[0].lower()
    drawn = [(_figure(f"{anchor}{k}", replay.joints, *figure), figure[1]) for k, figure in enumerate(figures)]
    body = render(
        "replay.html.j2",
        caption=caption,
        legend=list(zip(MODEL_COLOURS, [model.name for model in replay.models], strict=False)),
        figures=drawn,
        rows=[(joint, [model.get(joint, "–") for model in cells]) for joint in replay.joints],
    )
    return Section(anchor=anchor, title=title, body=body)


def _figure(name: str, joints: Sequence[str], models: Sequence[Mapping[str, float]], label: str) -> Markup:
    """Return a figure with a row a joint and a dot a model, on a logarithmic axis."""
    left = 24 + LETTER * max(map(len, joints), default=0)
    axes = new_axes("", "", height=AROUND + ROW * max(len(joints), 1), left=min(left, 180.0))
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_yticks(range(len(joints)), labels=joints)
    axes.set_ylim(len(joints) - 0.5, -0.5)
    for colour, values in zip(MODEL_COLOURS, models, strict=False):
        shown = [(values[joint], row) for row, joint in enumerate(joints) if values.get(joint, 0.0) > 0]
        axes.plot(*(zip(*shown, strict=True) if shown else ([], [])), "o", color=COLOURS[colour], markersize=5)
    return inline_svg(axes, f"{label}, by joint and model", name)
