"""Page of `stribeck inspect`: content of a log."""

from __future__ import annotations

from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

from stribeck.report.page import Section, render, write_page
from stribeck.report.timeline import timeline

if TYPE_CHECKING:  # only for types: the audit is above this room
    from stribeck.inspection import Inspection, JointInspection


def write_inspection(inspection: Inspection, path: str | Path) -> None:
    """Write an inspection as one self-contained HTML file, completely or not at all."""
    findings = _section("findings", "warnings", findings=inspection.audit) if inspection.audit else None
    sections = [
        findings,
        _section("joints", "inspection_joints", rows=_joint_rows(inspection.joints)),
        timeline(inspection.phases),
        _section("channels", "inspection_channels", inspection=inspection),
        _section("sampling", "inspection_sampling", inspection=inspection),
    ]
    log = PurePath(inspection.path).name or "log in memory"
    lead = render("inspection_heading.html.j2", inspection=inspection, log=log)
    write_page(path, f"A log of {inspection.robot}", sections, lead=lead)


def _section(name: str, template: str, **values: Any) -> Section:
    return Section(anchor=name, title=name.title(), body=render(f"{template}.html.j2", **values))


def _joint_rows(joints: dict[str, JointInspection]) -> list[dict[str, Any]]:
    """List the joints with their ranges, scaled per column and unit [%]."""
    rows: list[dict[str, Any]] = [{"name": name, "joint": joint, "ranges": []} for name, joint in joints.items()]
    scales: dict[tuple[int, str], float] = {}
    for joint in joints.values():
        for place, unit in enumerate(joint.units):
            most = max(map(abs, joint.spans[place][0]))
            scales[place, unit] = max(scales.get((place, unit), 0.0), most)
    for row in rows:
        for place, ((low, high), shown) in enumerate(row["joint"].spans):
            scale = 50 / (scales[place, row["joint"].units[place]] or 1.0)
            bar = {"left": 50 + scale * low, "width": scale * (high - low)}
            row["ranges"].append({"low": low, "high": high, "unit": shown, **bar})
    return rows
