"""The page of `stribeck inspect`: what a log holds, before anything is identified."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

from stribeck.finding import Finding
from stribeck.outputs import whole_or_not_at_all
from stribeck.report.figure import house_style
from stribeck.report.page import Section, render, render_page
from stribeck.report.timeline import timeline

if TYPE_CHECKING:  # the report stands below what inspects a log, and is given what was found
    from stribeck.inspection import Inspection, JointInspection

CHANNEL_UNITS = {
    "time": "s",
    "position": "rad",
    "velocity": "rad/s",
    "acceleration": "rad/s²",
    "torque": "N m",
    "external_torque": "N m",
    "base_orientation": "xyzw",
    "angular_velocity": "rad/s",
    "linear_acceleration": "m/s²",
    "foot_wrench": "N, N m",
    "foot_force": "N",
    "temperature": "°C",
}


def write_inspection(inspection: Inspection, path: str | Path) -> None:
    """Write what a log holds as one self-contained HTML file, whole or not at all."""
    with house_style():
        sections = [
            _findings(inspection.audit),
            _joints(inspection),
            timeline(inspection.phases),
            _channels(inspection),
            _sampling(inspection),
        ]
        page = render_page(
            f"A log of {inspection.robot}",
            [section for section in sections if section is not None],
            lead=render(
                "inspection_heading.html.j2",
                inspection=inspection,
                log=PurePath(inspection.path).name or "log made in memory",
            ),
        )
    with whole_or_not_at_all(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def _findings(findings: Sequence[Finding]) -> Section | None:
    if not findings:
        return None
    return Section(anchor="findings", title="Findings", body=render("warnings.html.j2", findings=findings, warnings=[]))


def _joints(inspection: Inspection) -> Section:
    """Return the ranges of each joint and how its torque agrees with the model's."""
    rows = [_joint_row(name, joint, inspection) for name, joint in inspection.joints.items()]
    return Section(anchor="joints", title="Joints", body=render("inspection_joints.html.j2", rows=rows))


def _joint_row(name: str, joint: JointInspection, inspection: Inspection) -> dict[str, Any]:
    reach = {
        kind: max(max(map(abs, getattr(other, kind))) for other in inspection.joints.values())
        for kind in ("position_range", "velocity_range", "torque_range")
    }
    ranges = [_bar(getattr(joint, kind), most) for kind, most in reach.items()]
    return {"name": name, "joint": joint, "ranges": ranges}


def _bar(span: tuple[float, float], most: float) -> dict[str, Any]:
    """Return a range with where its bar begins and how long it is, in percent of -most to most."""
    low, high = span
    scale = 50 / most if most > 0 else 0.0
    return {"low": low, "high": high, "left": 50 + scale * low, "width": scale * (high - low)}


def _channels(inspection: Inspection) -> Section:
    rows = [
        {
            "name": name,
            "shape": " × ".join(str(size) for size in shape),
            "unit": CHANNEL_UNITS.get(name, ""),
            "missing": inspection.missing.get(name, 0),
        }
        for name, shape in inspection.channels.items()
    ]
    return Section(anchor="channels", title="Channels", body=render("inspection_channels.html.j2", rows=rows))


def _sampling(inspection: Inspection) -> Section:
    return Section(
        anchor="sampling", title="Sampling", body=render("inspection_sampling.html.j2", inspection=inspection)
    )
