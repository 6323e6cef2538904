"""Page of `stribeck inspect`: content of a log, with the timeline of its contact modes."""

from collections.abc import Iterable
from pathlib import Path, PurePath

import numpy as np

from stribeck.app.report.charts import POINTS, Chart, Figures, axis, line, over_time
from stribeck.app.report.overview import FIRST
from stribeck.app.report.page import Section, render, section, write_page
from stribeck.check import Inspection, JointInspection
from stribeck.core.base.typing import Array

Phases = list[tuple[float, float, str, bool]]


def write_inspection(inspection: Inspection, path: str | Path) -> None:
    """Write an inspection as one self-contained HTML file, completely or not at all."""
    audit, joints = inspection.audit, inspection.joints
    sections = [
        section("findings", "Findings", "warnings", findings=audit[:FIRST], others=audit[FIRST:]) if audit else None,
        section("joints", "Joints", "inspection_joints", joints=joints, scales=_scales(joints.values())),
        _torques(inspection),
        timeline(inspection.phases) if len({phase[2] for phase in inspection.phases}) > 1 else None,
        section("channels", "Channels", "inspection_channels", inspection=inspection),
        section("sampling", "Sampling", "inspection_sampling", inspection=inspection),
    ]
    log = PurePath(inspection.path).name or "log in memory"
    lead = render("inspection_heading.html.j2", inspection=inspection, log=log)
    write_page(path, f"A log of {inspection.robot}", sections, lead=lead)


def _torques(inspection: Inspection) -> Section | None:
    """Draw measured torque and inverse dynamics of each joint over time; None if nothing is known."""
    data, figures = inspection.evidence, Figures()
    if data is None or len(data.rows) < 2:
        return None
    legend = (("data", "measured"), ("law", "model"))
    time = data.prepared.log.time[data.rows] - data.prepared.log.time[0]
    for k, name in enumerate(data.joints):
        values, unit = (data.torque[:, k], data.model[:, k]), "N" if inspection.joints[name].prismatic else "N m"
        label = f"torque [{unit}]"
        figures[f"m{k}"] = over_time(time, label, values, legend, POINTS // len(data.joints), "torques"), name
    return section("torques", "Measured and model torque", "torques", figures, legend=legend, what="model")


def _scales(joints: Iterable[JointInspection]) -> dict[tuple[int, str], float]:
    """Find the largest absolute value of the joints' ranges, per column and unit."""
    scales: dict[tuple[int, str], float] = {}
    for joint in joints:
        for key, (ends, _) in zip(enumerate(joint.units), joint.spans, strict=True):
            scales[key] = max(scales.get(key, 0.0), *map(abs, ends))
    return scales


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
    rows = {name: [(phase[1] - phase[0], phase[3]) for phase in phases if phase[2] == name] for name in names}
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
    starts, ends = np.array([phase[:2] for phase in phases]).reshape(-1, 2).T[:, :, None]
    overlap = np.minimum(ends, edges[1:]) - np.maximum(starts, edges[:-1])
    return np.asarray(np.maximum(overlap, 0.0).sum(axis=0) / np.diff(edges))
