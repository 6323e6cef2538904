"""Page of `stribeck replay`, with torques and positions over time, and recordings of them for the Rerun viewer."""

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from itertools import zip_longest
from pathlib import Path, PurePath

import numpy as np

from stribeck.app.report.charts import POINTS, Figures, over_time, with_residual
from stribeck.app.report.joints import elapsed, predictions
from stribeck.app.report.page import Section, number, render, section, share, write_page
from stribeck.core.base.outputs import whole_or_not_at_all
from stribeck.core.base.typing import Array
from stribeck.core.errors import require_extra
from stribeck.core.result import Result
from stribeck.design import Replay, Replayed

Curves = Mapping[tuple[str, str, str], tuple[Array, Array]]
"""Times from zero [s] and values, shape (N,) each, by joint, quantity and label."""

Legend = Sequence[tuple[str, str]]
"""Color and label of each line."""

Drawn = dict[str, tuple[str, list[Array]]]
"""Label of the vertical axis, then the measured values and the values of both models, by caption."""


def write_replay(replay: Replay, path: str | Path) -> None:
    """Write a replay as one self-contained HTML file, completely or not at all."""
    # the robot's own model and the other model, each without and with friction
    colours = ["muted", *(["ink"] if replay.models[1].friction else []), "data", "law"]
    legend = list(zip(colours, (model.name for model in replay.models), strict=False))

    def torque(model: Replayed, joint: str) -> str:
        error = model.torque.get(joint)
        return f"{number(error.rms)} ({share(error.r2, 2)})" if error else "–"

    def velocity(model: Replayed, joint: str) -> str:
        errors = model.rollouts.get(joint) or [None] * len(replay.horizons)
        return ", ".join(number(error.relative) if error else "–" for error in errors)

    tables = [
        _table(replay, "Torque error of inverse dynamics", torque, legend),
        _table(replay, "Velocity error of short simulations", velocity, legend),
    ]
    sections = [part for pair in zip_longest(_motion_sections(replay, legend), tables) for part in pair]
    lead = render("replay_heading.html.j2", replay=replay, log=PurePath(replay.log).name or "log in memory")
    write_page(path, f"{replay.robot}: a log replayed", sections, lead=lead)


def _table(replay: Replay, title: str, cell: Callable[[Replayed, str], str], legend: Legend) -> Section:
    """Render a table of values by model and joint."""
    rows = [(joint, [cell(model, joint) for model in replay.models]) for joint in replay.joints]
    what = title.partition(" ")[0].lower()
    return section(what, title, "replay", what=what, horizons=replay.horizons, legend=legend, rows=rows)


def _motion_sections(replay: Replay, legend: Legend) -> list[Section | None]:
    """Render a section of torques and one of positions, None if unknown; an empty list without motion.

    `legend` has one color per model of the replay.
    """
    motion = replay.motion
    chosen = [-2, -1] if replay.models[-1].friction else [0, -1]  # without friction, and the unchanged other model
    models, legend = [replay.models[k] for k in chosen], [("ink", "measured"), *(legend[k] for k in chosen)]
    if motion is None or min(len(motion.torque_time), len(motion.position_time)) < 2:
        return []
    time, torques, positions = motion.position_time, Drawn(), Drawn()
    for joint in replay.joints:
        position_unit, torque_unit = ("m", "N") if joint in motion.prismatic else ("rad", "N m")
        if all(joint in model.torque for model in models):
            errors = " → ".join(number(model.torque[joint].rms, 2) for model in models)
            lines = [motion.torque[joint], *(model.predicted[joint] for model in models)]
            torques[f"{joint}: error {errors} (RMS)"] = f"torque [{torque_unit}]", lines
        if all(joint in model.positions for model in models):
            lines = [motion.position[joint], *(pieces(time, *model.positions[joint], replay) for model in models)]
            positions[joint] = f"position [{position_unit}]", lines
    return [
        _over_log("Torque over the log", motion.torque_time, torques, legend, replay),
        _over_log("Position of short simulations", time, positions, legend, replay),
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


def _over_log(title: str, time: Array, drawn: Drawn, legend: Legend, replay: Replay) -> Section | None:
    """Render one chart per joint; all charts of a section zoom together."""
    anchor, points = title.partition(" ")[0].lower() + "-over-log", POINTS // max(len(drawn), 1)
    figures: Figures = {}
    for k, (caption, (label, values)) in enumerate(drawn.items()):
        key, chart = f"{anchor}{k}", over_time(time - time[0], label, values, legend, points, anchor)
        pair = with_residual(key, caption, chart, values, np.isfinite(values[0])) if label.startswith("torque") else {}
        figures |= pair or {key: (chart, caption)}
    about = {"what": anchor, "last": replay.horizons[-1]}
    return section(anchor, title, "torques", figures, legend=legend, **about) if figures else None


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


def curves_of_result(result: Result) -> Curves:
    """Collect torque, friction torque and velocity of each joint with friction, over all logs."""
    evidence = result.evidence
    assert evidence is not None  # of an identification
    samples, curves = evidence.samples, {}
    time = elapsed(samples)
    for column, name in enumerate(samples.joint_names):
        joint = result.joints.get(name)
        if joint is None or not joint.parameters or samples.torque is None or column >= samples.torque.shape[1]:
            continue
        measured, without, predicted = predictions(joint, samples, column)
        offset = joint.values.get("offset", 0.0)
        curves[name, "torque", "measured"] = time, measured
        curves[name, "torque", "without friction"] = time, without
        curves[name, "torque", "with friction"] = time, predicted
        curves[name, "friction", "measured"] = time, measured - without + offset
        curves[name, "friction", "identified"] = time, predicted - without + offset
        curves[name, "velocity", "measured"] = time, samples.velocity[:, column]
    return curves


def write_recording(curves: Curves, path: Path, name: str) -> None:
    """Write a recording of this name for the Rerun viewer, completely or not at all.

    Raises
    ------
    SettingsError
        If rerun-sdk is not installed.
    """
    require_extra("rerun", "rerun")
    viewer, blueprint = import_module("rerun"), import_module("rerun.blueprint")
    tabs = {joint: [kind for tab, kind, _ in curves if tab == joint] for joint, _, _ in curves}
    views = [
        blueprint.Vertical(
            *(blueprint.TimeSeriesView(name=k, origin=_path(joint, k)) for k in dict.fromkeys(kinds)), name=joint
        )
        for joint, kinds in tabs.items()
    ]
    with whole_or_not_at_all(path) as temporary, viewer.RecordingStream("stribeck") as recording:
        recording.send_recording_name(name)
        recording.save(str(temporary), default_blueprint=blueprint.Blueprint(blueprint.Tabs(*views)))
        for key, (time, values) in curves.items():
            index = viewer.TimeColumn("log", duration=time)
            recording.send_columns(_path(*key), indexes=[index], columns=viewer.Scalars.columns(scalars=values))
        recording.flush()
        recording.disconnect()


def _path(*parts: str) -> str:
    return str(import_module("rerun").new_entity_path(list(parts)))
