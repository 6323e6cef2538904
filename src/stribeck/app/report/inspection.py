"""Page of `stribeck inspect`: content of a log."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

from stribeck.app.priorities import FIRST
from stribeck.app.report.charts import Figures, over_time
from stribeck.app.report.page import Section, render, section, write_page
from stribeck.app.report.timeline import timeline
from stribeck.app.report.torques import POINTS

if TYPE_CHECKING:  # only for types: inspection is above this room
    from stribeck.check import Inspection, JointInspection


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
    about = "Torque of the log and of the model without friction, in means over short bins."
    return section("torques", "Measured and model torque", "torques", figures, legend=legend, about=about)


def _scales(joints: Iterable[JointInspection]) -> dict[tuple[int, str], float]:
    """Find the largest absolute value of the joints' ranges, per column and unit."""
    scales: dict[tuple[int, str], float] = {}
    for joint in joints:
        for key, (ends, _) in zip(enumerate(joint.units), joint.spans, strict=True):
            scales[key] = max(scales.get(key, 0.0), *map(abs, ends))
    return scales
