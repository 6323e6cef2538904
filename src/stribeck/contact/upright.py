"""Which way is up for the base, and when the robot has fallen."""

from collections.abc import Iterator

import numpy as np

from stribeck.dynamics.root_motion import gravity_in_root_link
from stribeck.dynamics.state import root_quaternions
from stribeck.errors import LogError
from stribeck.log import RobotLog
from stribeck.log.storage import BLOCK_ROWS
from stribeck.robot import Robot
from stribeck.typing import Array

FALLEN = np.deg2rad(60.0)
"""A base that is tilted by more than this has fallen [rad]."""


def up_in_base(log: RobotLog, robot: Robot) -> Array:
    """Return the upward direction in the root link's coordinates, shape (T, 3); a base without IMU counts as level."""
    up = -robot.gravity / np.linalg.norm(robot.gravity)
    if log.base_orientation is None:
        return np.broadcast_to(up, (len(log.time), 3))
    return gravity_in_root_link(root_quaternions(robot, log.position, log.base_orientation), up)


def row_of_fall(log: RobotLog, robot: Robot, segments: tuple[slice, ...]) -> int | None:
    """Return the first row within the segments at which the base has fallen over, None if it never does.

    Upright is the root link's z axis; a root link whose z axis does not point up when the robot stands would
    be taken for fallen from the start, and is refused as such.

    Raises
    ------
    LogError
        If the base is tilted that far from the start.
    """
    if log.base_orientation is None or not segments:
        return None
    for place, rows in enumerate(_blocks(segments)):
        tilt = np.arccos(np.clip(up_in_base(log.take(rows), robot)[:, 2], -1.0, 1.0))
        fallen = np.flatnonzero(tilt > FALLEN)
        if len(fallen) == 0:
            continue
        if place == 0 and fallen[0] == 0:
            if robot.gravity[2] > 0:
                raise LogError(
                    f"{log.path or 'log'}: [robot] gravity points up, {robot.gravity.tolist()} m/s^2, and the robot "
                    "stands on its head; expected gravity of the world, z down, as a rule [0, 0, -9.81]"
                )
            raise LogError(
                f"{log.path or 'log'}: base_orientation tilts the base by {np.rad2deg(tilt[0]):.0f} deg at the start, "
                'so that the robot lies; if it stands, set [log] base_orientation = {order = "wxyz"} or [robot] '
                "base_frame"
            )
        return int(rows.start + fallen[0])
    return None


def _blocks(segments: tuple[slice, ...]) -> Iterator[slice]:
    """Yield the rows of segments, some at a time."""
    for segment in segments:
        for start in range(segment.start, segment.stop, BLOCK_ROWS):
            yield slice(start, min(start + BLOCK_ROWS, segment.stop))
