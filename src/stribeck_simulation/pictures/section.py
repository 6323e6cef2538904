"""The simulated walk: where the feet stood and the centre of mass went, and the robot over one stride."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from stribeck.report.charts import Chart, axis, image, line
from stribeck.report.page import Section, render
from stribeck.result.mirror import mirrored_pairs
from stribeck.typing import Array
from stribeck_simulation.pictures.walk import SEEN_FROM, Footprint, Pose, WalkPicture

LONG = 4.0
"""A walk that reaches further than this is drawn a second time, closer [m]."""
CLOSE_UP = 2.4
"""Length and width of the close-up [m]."""
SAME_PLACE = 2e-3
"""A foot that comes down this near to an earlier print leaves no other [m]."""
NARROWEST, GAP = 0.24, 0.06
"""Least room of a pose, for its time, and the gap between poses; as shares of the robot's height."""

Window = tuple[float, float, float, float]
"""Least and greatest x, least and greatest y [m]."""


def walk_section(picture: WalkPicture) -> Section:
    """Return the report's section with the walk from above and its strip of poses."""
    colours = side_colours([*picture.segment_names, *(print_.foot for print_ in picture.footprints)])
    span = f"{picture.poses[0].time:.2f} to {picture.poses[-1].time:.2f} s"
    window = _window(picture)
    figures = [("w1", "From above; strong: while the poses last; fainter: earlier"), ("w2", f"The robot from {span}")]
    charts = {"w2": strip(picture, colours)}
    if max(window[1] - window[0], window[3] - window[2]) > LONG:
        figures.insert(0, ("w0", "The whole walk from above; fainter: earlier"))
        charts["w0"] = from_above(picture, colours, window)
        x, y = picture.poses[len(picture.poses) // 2].place
        reach = CLOSE_UP / 2
        window = (
            max(x - reach, window[0]),
            min(x + reach, window[1]),
            max(y - reach, window[2]),
            min(y + reach, window[3]),
        )
    charts["w1"] = from_above(picture, colours, window)
    sides = [("data", "left"), ("right", "right")] if {"data", "right"} <= set(colours.values()) else []
    body = render("figure_row.html.j2", figures=figures, legend=[*sides, ("path", "centre of mass")])
    return Section(anchor="walk", title="Walk", body=body, charts=charts)


def side_colours(names: list[str]) -> dict[str, str]:
    """Return the page's colour of each joint or foot: `data` on the left, `right` on the right, `ink` in the middle."""
    colours = dict.fromkeys(names, "ink")
    for left, right in mirrored_pairs(dict.fromkeys(names)):
        colours[left], colours[right] = "data", "right"
    return colours


def _window(picture: WalkPicture) -> Window:
    """Return the least and greatest x and y of all that is drawn from above [m]."""
    soles = [outline(one) for one in picture.footprints]
    points = np.vstack([picture.com, *soles])
    (low_x, low_y), (high_x, high_y) = points.min(axis=0) - 0.01, points.max(axis=0) + 0.01
    return float(low_x), float(high_x), float(low_y), float(high_y)


def from_above(picture: WalkPicture, colours: Mapping[str, str], window: Window) -> Chart:
    """Draw footprints and the way of the centre of mass with equal axes; what is earlier is fainter.

    The way is drawn stronger while the poses last.
    """
    lines: list[dict[str, Any]] = []
    strengths = np.linspace(0.25, 1.0, max(len(picture.footprints), 2))
    last_at = {(one.foot, *np.round(np.array(one.place) / SAME_PLACE)): k for k, one in enumerate(picture.footprints)}
    for k in sorted(last_at.values()):
        one, strength = picture.footprints[k], float(strengths[k])
        x, y = outline(one).T
        lines.append(line(x, y, colours[one.foot], closed=True, fill=0.45 * strength, opacity=strength))
    for rows, strength in zip(np.array_split(np.arange(len(picture.com)), 24), np.linspace(0.2, 0.8, 24), strict=True):
        if len(rows):  # up to where the next part begins
            x, y = picture.com[rows[0] : rows[-1] + 2].T
            lines.append(line(x, y, "muted", closed=True, width=0.8, opacity=float(strength)))
    first, last = picture.poses[0].time, picture.poses[-1].time
    marked = picture.com[(picture.com_time >= first) & (picture.com_time <= last)]
    lines.append(line(marked[:, 0], marked[:, 1], "ink", closed=True, width=1.4))
    return {"x": axis("x [m]", window[:2]), "y": axis("y [m]", window[2:]), "lines": lines, "equal": True}


def outline(one: Footprint) -> Array:
    """Return the outline of a sole [m]: a rectangle with cut corners, more so at the toe; shape (9, 2)."""
    long, wide = max(one.size[0] / 2, 0.01), max(one.size[1] / 2, 0.01)
    toe, heel = 0.6 * min(wide, long), 0.25 * min(wide, long)
    right = np.array([[long, toe - wide], [long - toe, -wide], [heel - long, -wide], [-long, heel - wide]])
    points = np.vstack([right, right[::-1] * [1, -1], right[:1]])
    sine, cosine = np.sin(one.yaw), np.cos(one.yaw)
    return np.asarray(points @ np.array([[cosine, sine], [-sine, cosine]]) + one.place)


def strip(picture: WalkPicture, colours: Mapping[str, str]) -> Chart:
    """Draw the poses side by side on the ground, each with its time beneath."""
    shown = [(pose, seen_from_the_side(pose)) for pose in picture.poses]
    edges = np.array([_edges(pose, view) for pose, view in shown])
    lowest = min(float(edges[:, 2].min()), 0.0)
    tall = float(edges[:, 3].max()) - lowest
    room = np.maximum(edges[:, 1] - edges[:, 0], NARROWEST * tall) + GAP * tall
    middles = np.cumsum(room) - room / 2
    width = float(room.sum())
    lines = [line([0.0, width], [0.0, 0.0], "muted", closed=True, width=0.8)]
    images = []
    for (pose, view), middle, own in zip(shown, middles, edges, strict=True):
        root = float(middle - own[:2].mean())
        if pose.picture is not None:
            extent = (root + own[0], root + own[1]), (own[2], own[3])
            images.append(image(pose.picture.pixels, *extent) | {"smooth": True})
            continue
        for k in np.argsort(-view[..., 2].mean(axis=1), kind="stable"):  # what is far first
            lines.append(
                line(view[k, :, 0] + root, view[k, :, 1], colours[picture.segment_names[k]], closed=True, width=2.2)
            )
    times = {"at": middles.tolist(), "names": [f"{pose.time:.2f}" for pose in picture.poses]}
    x, y = axis("time [s]", (0.0, width), **times), axis("", (lowest - GAP * tall, lowest + (1 + GAP) * tall), names=[])
    return {"x": x, "y": y, "lines": lines, "images": images, "equal": True}


def _edges(pose: Pose, view: Array) -> Window:
    """Return left, right, lower and upper edge of what is shown of a pose [m]."""
    if pose.picture is not None:
        return pose.picture.left, pose.picture.right, pose.picture.bottom, pose.picture.top
    (left, bottom), (right, top) = view[..., :2].min(axis=(0, 1)), view[..., :2].max(axis=(0, 1))
    return float(left), float(right), float(bottom), float(top)


def seen_from_the_side(pose: Pose) -> Array:
    """Return the lines as (to the right, up, away) from the viewer, the root link in the middle, shape (S, 2, 3)."""
    shifted = pose.segments - [*pose.place, 0.0]
    # To the viewer's right is where the robot faces, turned towards its left by SEEN_FROM.
    sine, cosine = np.sin(pose.yaw + SEEN_FROM), np.cos(pose.yaw + SEEN_FROM)
    x, y, z = np.moveaxis(shifted, -1, 0)
    return np.stack([cosine * x + sine * y, z, -sine * x + cosine * y], axis=-1)
