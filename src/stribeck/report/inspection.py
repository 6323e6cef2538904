"""Page of `stribeck inspect`: content of a log."""

from __future__ import annotations

from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

from stribeck.report.page import Section, render, write_page
from stribeck.report.timeline import timeline

if TYPE_CHECKING:  # only for types: the audit is above this room
    from stribeck.audit.inspection import Inspection, JointInspection


def write_inspection(inspection: Inspection, path: str | Path) -> None:
    """Write an inspection as one self-contained HTML file, completely or not at all."""
    sections = {
        "findings": render("warnings.html.j2", findings=inspection.audit, warnings=[]) if inspection.audit else None,
        "joints": render("inspection_joints.html.j2", rows=_joint_rows(inspection.joints)),
        "timeline": timeline(inspection.phases),
        "channels": render("inspection_channels.html.j2", inspection=inspection),
        "sampling": render("inspection_sampling.html.j2", inspection=inspection),
    }
    log = PurePath(inspection.path).name or "log in memory"
    write_page(
        path,
        f"A log of {inspection.robot}",
        [
            part if part is None or isinstance(part, Section) else Section(anchor=name, title=name.title(), body=part)
            for name, part in sections.items()
        ],
        lead=render("inspection_heading.html.j2", inspection=inspection, log=log),
    )


def _joint_rows(joints: dict[str, JointInspection]) -> list[dict[str, Any]]:
    """List the joints with their ranges, scaled per column [%]."""
    kinds = ("position_range", "velocity_range", "torque_range")
    rows: list[dict[str, Any]] = [{"name": name, "joint": joint, "ranges": []} for name, joint in joints.items()]
    for kind in kinds:
        scale = 50 / (max((max(map(abs, getattr(joint, kind))) for joint in joints.values()), default=0.0) or 1.0)
        for row in rows:
            low, high = getattr(row["joint"], kind)
            row["ranges"].append({"low": low, "high": high, "left": 50 + scale * low, "width": scale * (high - low)})
    return rows
