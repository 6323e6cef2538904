"""Page of `stribeck trends`: alarms, friction of each joint over time, and the friction of the type."""

from pathlib import Path

import numpy as np

from stribeck.app.report.charts import Chart, Figures, axis, density, line, robust_limits
from stribeck.app.report.page import render, section, write_page
from stribeck.service import Trends


def write_trends(trends: Trends, path: str | Path) -> None:
    """Write the trends as one self-contained HTML file, completely or not at all."""
    figures: Figures = {}
    changed = {(alarm.robot, alarm.joint): "law" for alarm in trends.alarms}
    shown = changed | {(entry.robot, entry.joint): "ink" for entry in trends.odd} | changed  # changes are drawn first
    for joint in dict.fromkeys(channel.joint for channel in trends.fleet.channels):
        colours = {robot: colour for (robot, of), colour in shown.items() if of == joint}
        figures[f"t{len(figures)}"] = _chart(trends, joint, colours)
    sections = [
        section("alarms", "Changes", "trends_tables", found=trends),
        section("joints", "Joints over time", "trends", figures),
        section("type", "Friction of the type", "trends_type", found=trends),
    ]
    write_page(path, trends.title, sections, lead=render("lead.html.j2", term="Result", text=trends.conclusion))


def _chart(trends: Trends, joint: str, shown: dict[str, str]) -> tuple[Chart, str]:
    """Draw the friction of a joint over the days since the first log, at the speed of its largest change."""
    fleet = trends.fleet
    channels = [channel for channel, joint_speed in enumerate(fleet.channels) if joint_speed.joint == joint]
    alarms = [alarm for alarm in trends.alarms if alarm.joint == joint]
    wanted = [channel for channel in channels if alarms and fleet.channels[channel].velocity == alarms[0].velocity]
    channel = wanted[0] if wanted else channels[len(channels) // 2]
    at = fleet.channels[channel]
    day, label = (fleet.start - fleet.start.min()) / np.timedelta64(1, "D"), "days since the first log [d]"
    if day.max() < 0.1:  # logs without dates
        day, label = 1.0 + np.argsort(np.argsort(fleet.start, kind="stable")), "log number"
    friction = fleet.friction[:, channel]
    known = np.flatnonzero(np.isfinite(friction))
    lines, drawn = [], dict(list(shown.items())[:4])  # more lines hide each other
    spread = next(row.log_spread for row in trends.friction if (row.joint, row.velocity) == (joint, at.velocity))
    for robot, colour in drawn.items():
        logs = np.flatnonzero((fleet.robots == robot) & np.isfinite(friction))
        half = 1.96 * spread * np.array([[-1.0], [1.0]])
        lines.append(line(day[logs], friction[logs], colour, robot, band=friction[logs] + half, width=1.5))
    first, last = float(day.min()), float(day.max())
    days = first - 0.02 * (last - first), last + 0.02 * (last - first) + 1e-6
    limits = robust_limits(friction[known], share=0.0, margin=0.15)
    chart = {
        "x": axis(label, days),
        "y": axis(f"friction [{at.unit}]", limits),
        "images": [density(day[known], friction[known], days, limits, (45, 75))],
        "lines": lines,
        "marks": [float(day[(fleet.log == alarm.log) & (fleet.robots == alarm.robot)][0]) for alarm in alarms],
    }
    return chart, ": ".join(filter(None, (f"{joint} at {at.speed}", ", ".join(drawn))))
