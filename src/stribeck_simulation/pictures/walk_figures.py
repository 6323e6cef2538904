"""The figures of a walk: from above, and as a strip of poses."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from stribeck.report.figure import COLOURS, HEIGHT, WIDTH, new_axes
from stribeck.typing import Array
from stribeck_simulation.pictures.walk import SEEN_FROM, Footprint, Pose, WalkPicture

LOWEST = 90.0
"""Least height of what is seen from above [SVG units]."""
FAINTEST = 0.25
"""Opacity of what came first; the last is fully drawn."""
SHADES = 24
"""Steps of opacity along the way of the centre of mass."""
ARROWS = 4
"""Heads along the part of the way that is marked."""
SAME_PLACE = 2e-3
"""A foot that comes down this near to an earlier print leaves no other [m]."""
GAP = 0.06
"""Between poses, as a share of the robot's height."""
NARROWEST = 0.24
"""Room of a pose at the least, so that there is some for its time; as a share of the robot's height."""

Window = tuple[float, float, float, float]
"""Least and greatest x, least and greatest y [m]."""
Span = tuple[float, float]
"""Start and end [s]."""


def from_above(picture: WalkPicture, colours: Mapping[str, str], window: Window, marked: Span) -> Axes:
    """Draw footprints and the way of the centre of mass with equal axes; what is earlier is fainter.

    The way is drawn stronger, and with heads that say where it leads, in the time that is marked.
    """
    low_x, high_x, low_y, high_y = window
    pad = 0.04 * max(high_x - low_x, high_y - low_y)
    reach_x, reach_y = (high_x - low_x) / 2 + pad, (high_y - low_y) / 2 + pad
    left, right, above_and_below = 50.0, 8.0, 40.0  # room for labels [SVG units], as in `new_axes`
    width = WIDTH - left - right
    height = min(max(width * reach_y / reach_x, LOWEST), HEIGHT - above_and_below)
    axes = new_axes("x [m]", "y [m]", height=height + above_and_below, left=left)
    metres = 2 * max(reach_x / width, reach_y / height)  # of one SVG unit, both ways
    x, y = (low_x + high_x) / 2, (low_y + high_y) / 2
    seen = (x - metres * width / 2, x + metres * width / 2, y - metres * height / 2, y + metres * height / 2)
    axes.set_xlim(*seen[:2])
    axes.set_ylim(*seen[2:])
    axes.yaxis.set_major_locator(MaxNLocator(max(2, int(height / 45)), steps=[1, 2, 5, 10]))
    _draw_footprints(axes, picture.footprints, colours, seen)
    _draw_way(axes, picture, seen, marked)
    return axes


def _draw_footprints(axes: Axes, footprints: tuple[Footprint, ...], colours: Mapping[str, str], window: Window) -> None:
    strengths = np.linspace(FAINTEST, 1.0, max(len(footprints), 2))
    last_at = {(one.foot, _place(one)): k for k, one in enumerate(footprints)}
    for k in sorted(last_at.values()):
        one = footprints[k]
        if not _inside(np.array([one.place]), window)[0]:
            continue
        colour, strength = COLOURS[colours[one.foot]], float(strengths[k])
        if min(one.size) <= 0:
            axes.plot(*one.place, "o", color=colour, alpha=strength, markersize=5, zorder=2)
            continue
        style = {"facecolor": colour, "edgecolor": colour, "linewidth": 1.0, "zorder": 2}
        axes.add_patch(PathPatch(_sole(one), fill=True, **style | {"linewidth": 0}, alpha=0.45 * strength))
        axes.add_patch(PathPatch(_sole(one), fill=False, **style, alpha=strength))


def _place(one: Footprint) -> tuple[int, int]:
    return round(one.place[0] / SAME_PLACE), round(one.place[1] / SAME_PLACE)


def _sole(one: Footprint) -> Path:
    """Return the outline of a sole: a rectangle whose corners are round, more so at the toe."""
    half_length, half_width = one.size[0] / 2, one.size[1] / 2
    toe, heel = min(half_width, half_length), 0.4 * min(half_width, half_length)
    corners = ((1, 1, toe), (-1, 1, heel), (-1, -1, heel), (1, -1, toe))
    points, codes = [], []
    for k, (ahead, left, radius) in enumerate(corners):
        corner = np.array([ahead * half_length, left * half_width])
        along_x, along_y = corner - [ahead * radius, 0], corner - [0, left * radius]
        first, last = (along_y, along_x) if k % 2 == 0 else (along_x, along_y)
        points += [first, corner, last]
        codes += [Path.MOVETO if k == 0 else Path.LINETO, Path.CURVE3, Path.CURVE3]
    sine, cosine = np.sin(one.yaw), np.cos(one.yaw)
    turned = np.array(points) @ np.array([[cosine, sine], [-sine, cosine]]) + one.place
    return Path(np.vstack([turned, turned[:1]]), [*codes, Path.CLOSEPOLY])


def _draw_way(axes: Axes, picture: WalkPicture, window: Window, marked: Span) -> None:
    com, time = picture.com, picture.com_time
    parts = np.array_split(np.arange(len(com)), min(SHADES, max(len(com) // 2, 1)))
    for strength, rows in zip(np.linspace(FAINTEST, 1.0, len(parts)), parts, strict=True):
        joined = com[rows[0] : rows[-1] + 2]  # up to where the next part begins
        axes.plot(*joined.T, color=COLOURS["muted"], alpha=0.8 * float(strength), linewidth=0.8, zorder=3)
    way = com[(time >= marked[0]) & (time <= marked[1]) & _inside(com, window)]
    axes.plot(*way.T, color=COLOURS["ink"], linewidth=1.2, zorder=4)
    steps = np.linalg.norm(np.diff(way, axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(steps)])
    for share in (np.arange(ARROWS) + 0.5) / ARROWS:
        k = min(int(np.searchsorted(length, share * length[-1])), len(way) - 2)
        if k >= 0 and steps[k] > 0:
            ahead = np.degrees(np.arctan2(*(way[k + 1] - way[k])[::-1]))
            axes.plot(*way[k], marker=(3, 0, ahead - 90), color=COLOURS["ink"], markersize=5, zorder=5)


def _inside(points: Array, window: Window) -> NDArray[np.bool_]:
    low_x, high_x, low_y, high_y = window
    x, y = points.T
    inside: NDArray[np.bool_] = (x >= low_x) & (x <= high_x) & (y >= low_y) & (y <= high_y)
    return inside


def strip(picture: WalkPicture, colours: Mapping[str, str]) -> Axes:
    """Draw the poses side by side on the ground, each with its time beneath."""
    shown = [(pose, seen_from_the_side(pose)) for pose in picture.poses]
    edges = np.array([_edges(pose, view) for pose, view in shown])
    lowest = min(float(edges[:, 2].min()), 0.0)
    tall = float(edges[:, 3].max()) - lowest
    room = np.maximum(edges[:, 1] - edges[:, 0], NARROWEST * tall) + GAP * tall
    middles = np.cumsum(room) - room / 2
    scale = (WIDTH - 16) / float(room.sum())  # [SVG units / m]
    axes = new_axes("time [s]", "", height=(1 + 2 * GAP) * tall * scale + 40.0, left=8.0)
    axes.axhline(0.0, color=COLOURS["muted"], linewidth=0.8, zorder=1)
    for (pose, view), root in zip(shown, middles - edges[:, :2].mean(axis=1), strict=True):
        if pose.picture is None:
            _draw_sticks(axes, view, float(root), picture.segment_names, colours)
        else:
            left, right, bottom, top = _edges(pose, view)
            extent = (root + left, root + right, bottom, top)
            axes.imshow(pose.picture.pixels, extent=extent, aspect="auto", interpolation="none", zorder=3)
    axes.set_xlim(0, float(room.sum()))
    axes.set_ylim(lowest - GAP * tall, lowest + (1 + GAP) * tall)
    axes.set_xticks(middles, [f"{pose.time:.2f}" for pose in picture.poses])
    axes.set_yticks([])
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    return axes


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


def _draw_sticks(axes: Axes, view: Array, middle: float, names: tuple[str, ...], colours: Mapping[str, str]) -> None:
    order = np.argsort(-view[..., 2].mean(axis=1), kind="stable")  # what is far first
    lines = view[order, :, :2] + [middle, 0.0]
    shown = [COLOURS[colours[names[k]]] for k in order]
    axes.add_collection(LineCollection(list(lines), colors=shown, linewidths=2.2, capstyle="round", zorder=3))
