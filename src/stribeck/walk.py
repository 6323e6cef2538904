"""What a report draws of a simulated walk: footprints, the way of the centre of mass, and the robot's poses."""

from __future__ import annotations

from dataclasses import dataclass

from stribeck.log import Array


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
    """

    time: float
    segments: Array
    place: tuple[float, float]
    yaw: float


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
        Six to ten over one stride, in the order of time.
    segment_names
        Joint or contact that each line of the stick figures leads to, S of them.
    """

    footprints: tuple[Footprint, ...]
    com_time: Array
    com: Array
    poses: tuple[Pose, ...]
    segment_names: tuple[str, ...]
