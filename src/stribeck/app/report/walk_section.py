"""The report's section on a simulated walk: a view from above, and poses of one stride."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from stribeck.app.report.charts import Chart, axis, line
from stribeck.app.report.page import Section, render
from stribeck.core.base.typing import Array
from stribeck.core.result.mirror import mirrored_pairs
from stribeck.simulation import Footprint, Pose, WalkPicture

SEEN_FROM = np.deg2rad(25.0)
"""Angle of the view from the right towards the front [rad], which separates left and right limbs."""


def walk_section(picture: WalkPicture) -> Section:
    """Draw the walk from above and a strip of poses."""
    colours = side_colours([*picture.segment_names, *(print_.foot for print_ in picture.footprints)])
    span = f"{picture.poses[0].time:.2f} to {picture.poses[-1].time:.2f} s"
    figures = [("w1", "From above; strong: while the poses last; fainter: earlier"), ("w2", f"The robot from {span}")]
    charts = {"w1": from_above(picture, colours), "w2": strip(picture, colours)}
    sides = [("data", "left"), ("right", "right")] if {"data", "right"} <= set(colours.values()) else []
    body = render("figure_row.html.j2", figures=figures, legend=[*sides, ("path", "center of mass")])
    return Section(anchor="walk", title="Walk", body=body, charts=charts)


def side_colours(names: list[str]) -> dict[str, str]:
    """Assign a color of the page to each joint or foot: `data` on the left, `right` on the right, else `ink`."""
    colours = dict.fromkeys(names, "ink")
    for left, right in mirrored_pairs(dict.fromkeys(names)):
        colours[left], colours[right] = "data", "right"
    return colours


def from_above(picture: WalkPicture, colours: Mapping[str, str]) -> Chart:
    """Draw footprints and the path of the center of mass with equal axes; earlier parts are fainter.

    The path is thicker during the poses. A footprint within 2 mm of an earlier print is not drawn.
    """
    lines: list[dict[str, Any]] = []
    strengths = np.linspace(0.25, 1.0, max(len(picture.footprints), 2))
    last_at = {(sole.foot, *np.round(np.array(sole.place) / 2e-3)): k for k, sole in enumerate(picture.footprints)}
    for k in sorted(last_at.values()):
        footprint, strength = picture.footprints[k], float(strengths[k])
        x, y = outline(footprint).T
        lines.append(line(x, y, colours[footprint.foot], closed=True, fill=0.45 * strength, opacity=strength))
    for rows, strength in zip(np.array_split(np.arange(len(picture.com)), 24), np.linspace(0.2, 0.8, 24), strict=True):
        if len(rows):  # up to the start of the next part
            x, y = picture.com[rows[0] : rows[-1] + 2].T
            lines.append(line(x, y, "muted", closed=True, width=0.8, opacity=float(strength)))
    first, last = picture.poses[0].time, picture.poses[-1].time
    marked = picture.com[(picture.com_time >= first) & (picture.com_time <= last)]
    lines.append(line(marked[:, 0], marked[:, 1], "ink", closed=True, width=1.4))
    points = np.vstack([picture.com, *(outline(footprint) for footprint in picture.footprints)])
    spans = np.column_stack([points.min(axis=0) - 0.01, points.max(axis=0) + 0.01]).tolist()
    x, y = (axis(f"{name} [m]", tuple(span)) for name, span in zip("xy", spans, strict=True))
    return {"x": x, "y": y, "lines": lines, "equal": True}


def outline(footprint: Footprint) -> Array:
    """Compute the outline of a sole [m]: a rectangle with cut corners, more so at the toe; shape (9, 2)."""
    long, wide = max(footprint.size[0] / 2, 0.01), max(footprint.size[1] / 2, 0.01)
    toe, heel = 0.6 * min(wide, long), 0.25 * min(wide, long)
    right = np.array([[long, toe - wide], [long - toe, -wide], [heel - long, -wide], [-long, heel - wide]])
    points = np.vstack([right, right[::-1] * [1, -1], right[:1]])
    sine, cosine = np.sin(footprint.yaw), np.cos(footprint.yaw)
    return np.asarray(points @ np.array([[cosine, sine], [-sine, cosine]]) + footprint.place)


def strip(picture: WalkPicture, colours: Mapping[str, str]) -> Chart:
    """Draw the poses side by side on the ground, each with its time below."""
    views = [seen_from_the_side(pose) for pose in picture.poses]
    lows = np.array([view[..., :2].min(axis=(0, 1)) for view in views])
    highs = np.array([view[..., :2].max(axis=(0, 1)) for view in views])
    lowest = min(float(lows[:, 1].min()), 0.0)
    tall = float(highs[:, 1].max()) - lowest
    gap = 0.06 * tall
    room = np.maximum(highs[:, 0] - lows[:, 0], 0.24 * tall) + gap  # wide enough for the time
    middles = np.cumsum(room) - room / 2
    width = float(room.sum())
    lines = [line([0.0, width], [0.0, 0.0], "muted", closed=True, width=0.8)]
    for view, root in zip(views, (middles - (lows + highs)[:, 0] / 2).tolist(), strict=True):
        for k in np.argsort(-view[..., 2].mean(axis=1), kind="stable"):  # distant lines first
            colour = colours[picture.segment_names[k]]
            lines.append(line(view[k, :, 0] + root, view[k, :, 1], colour, closed=True, width=2.2))
    times = {"at": middles.tolist(), "names": [f"{pose.time:.2f}" for pose in picture.poses]}
    x, y = axis("time [s]", (0.0, width), **times), axis("", (lowest - gap, lowest + tall + gap), names=[])
    return {"x": x, "y": y, "lines": lines, "equal": True}


def seen_from_the_side(pose: Pose) -> Array:
    """Compute the lines as (to the right, up, away) from the viewer, relative to the root link, shape (S, 2, 3)."""
    shifted = pose.segments - [*pose.configuration[:2], 0.0]
    # To the viewer's right is where the robot faces, turned towards its left by SEEN_FROM.
    sine, cosine = np.sin(pose.yaw + SEEN_FROM), np.cos(pose.yaw + SEEN_FROM)
    x, y, z = np.moveaxis(shifted, -1, 0)
    return np.stack([cosine * x + sine * y, z, -sine * x + cosine * y], axis=-1)
