"""What a report draws of a simulated walk: footprints, the way of the centre of mass, and the robot's poses."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stribeck.typing import Array

SEEN_FROM = np.deg2rad(25.0)
"""Poses are seen from the right and this much from the front, which keeps left and right limbs apart [rad]."""


@dataclass(frozen=True, kw_only=True)
class Footprint:
    """Where a foot stood.

    Attributes
    ----------
    foot
        Name of the contact.
    place
        Middle of the sole in the world [m].
    yaw
        Of the foot in the world [rad].
    size
        Length and width of the sole [m]; zeros for a point.
    time
        Of the touchdown [s].
    """

    foot: str
    place: tuple[float, float]
    yaw: float
    size: tuple[float, float]
    time: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Picture:
    """The robot seen from the side, without perspective.

    Attributes
    ----------
    pixels
        Red, green, blue and opacity, from the top row down, shape (H, W, 4).
    left, right
        Edges, from the root link on [m].
    bottom, top
        Edges, from the ground on [m].
    """

    pixels: NDArray[np.uint8]
    left: float
    right: float
    bottom: float
    top: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Pose:
    """The robot at one time.

    Attributes
    ----------
    time
        [s]
    segments
        Start and end of each of the stick figure's lines in the world [m], shape (S, 2, 3).
    place
        Of the root link in the world, seen from above [m].
    yaw
        Where the robot faces [rad].
    picture
        To be shown in place of the stick figure; seen as `SEEN_FROM` says.
    """

    time: float
    segments: Array
    place: tuple[float, float]
    yaw: float
    picture: Picture | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class WalkPicture:
    """A walk as it is drawn.

    Attributes
    ----------
    footprints
        In the order of their touchdowns.
    com_time, com
        Way of the centre of mass, seen from above: [s], shape (N,), and [m], shape (N, 2).
    poses
        Six to ten, in the order of time: over one stride, if there is one.
    segment_names
        Joint or contact that each line of the stick figures leads to, S of them.
    """

    footprints: tuple[Footprint, ...]
    com_time: Array
    com: Array
    poses: tuple[Pose, ...]
    segment_names: tuple[str, ...]
