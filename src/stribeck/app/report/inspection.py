"""Page of `stribeck inspect`: content of a log."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

from stribeck.app.report.page import render, section, write_page
from stribeck.app.report.timeline import timeline

if TYPE_CHECKING:  # only for types: inspection is above this room
    from stribeck.check import Inspection, JointInspection


def write_inspection(inspection: Inspection, path: str | Path) -> None:
    """Write an inspection as one self-contained HTML file, completely or not at all."""
    audit, joints = inspection.audit, inspection.joints
    sections = [
        section("findings", "Findings", "warnings", findings=audit) if audit else None,
        section("joints", "Joints", "inspection_joints", joints=joints, scales=_scales(joints.values())),
        timeline(inspection.phases),
        section("channels", "Channels", "inspection_channels", inspection=inspection),
        section("sampling", "Sampling", "inspection_sampling", inspection=inspection),
    ]
    log = PurePath(inspection.path).name or "log in memory"
    lead = render("inspection_heading.html.j2", inspection=inspection, log=log)
    write_page(path, f"A log of {inspection.robot}", sections, lead=lead)


def _scales(joints: Iterable[JointInspection]) -> dict[tuple[int, str], float]:
    """Find the largest absolute value of the joints' ranges, per column and unit."""
    scales: dict[tuple[int, str], float] = {}
    for joint in joints:
        for key, (ends, _) in zip(enumerate(joint.units), joint.spans, strict=True):
            scales[key] = max(scales.get(key, 0.0), *map(abs, ends))
    return scales
