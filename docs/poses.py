"""Poses of a simulated walk over one stride, from its log and the true path of its base."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.core.robot.kinematics import frame_pose


@dataclass(frozen=True, eq=False, kw_only=True)
class Pose:
    """The robot at one time.

    Attributes
    ----------
    time
        Time of the pose [s].
    configuration
        Position and quaternion xyzw of the root link, then the tree's joints, shape (7 + n,).
    """

    time: float
    configuration: Array

    @property
    def yaw(self) -> float:
        """Heading of the robot [rad]."""
        turn = Rotation.from_quat(self.configuration[3:7]).as_matrix()
        return float(np.arctan2(turn[1, 0], turn[0, 0]))


def walk_poses(robot: Robot, log: RobotLog, base_position: Array) -> tuple[Pose, ...]:
    """Compute the poses of one stride.

    Parameters
    ----------
    robot
        Robot with a floating base.
    log
        Log without noise, with base orientation and contacts.
    base_position
        Position of the root link in the world [m], shape (T, 3).

    Raises
    ------
    SettingsError
        If the robot's base is fixed, or the log has no base orientation or contact.
    """
    if robot.base == "fixed" or log.base_orientation is None or log.contact is None:
        raise SettingsError(
            f"{robot.name}: a walk cannot be drawn; expected a floating base, base_orientation and contact"
        )
    configurations = _configurations(robot, log, base_position)
    rows = _pose_rows(stances(log.time, log.contact), base_position)
    return tuple(Pose(time=float(log.time[row]), configuration=configurations[row]) for row in rows)


def stances(time: Array, contact: NDArray[np.bool_]) -> list[tuple[int, int, int]]:
    """Find the first and last sample and the foot of each stance, in the order of the touchdowns.

    `contact` has shape (T, feet).

    A contact of less than 50 ms does not count as a stance, and an interruption of less than 100 ms as a swing.
    """
    phases = []
    for foot, flags in enumerate(contact.T):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
        spans = edges.reshape(-1, 2) - [0, 1]
        spans = spans[time[spans[:, 1]] - time[spans[:, 0]] >= 0.05]
        lifted = np.flatnonzero(time[spans[1:, 0]] - time[spans[:-1, 1]] >= 0.1) + 1
        phases += [(int(run[0, 0]), int(run[-1, 1]), foot) for run in np.split(spans, lifted) if len(run)]
    return sorted(phases)


def _pose_rows(phases: list[tuple[int, int, int]], base_position: Array) -> NDArray[np.int64]:
    """Select rows of the longest stride (within 0.1 m) that is nearest to the middle, between touchdowns of a foot.

    If the robot only stands, the poses cover the entire time.
    """
    middle = len(base_position) // 2
    touchdowns = [(start, foot) for start, _, foot in phases if start > 0]
    strides = [
        (start, next_start)
        for k, (start, foot) in enumerate(touchdowns)
        if (next_start := next((later for later, other in touchdowns[k + 1 :] if other == foot), None)) is not None
    ]

    def rank(stride: tuple[int, int]) -> tuple[int, float]:
        way = np.linalg.norm(base_position[stride[1], :2] - base_position[stride[0], :2])
        return -round(float(way) / 0.1), abs(sum(stride) / 2 - middle)

    start, end = min(strides, key=rank, default=(0, len(base_position) - 1))
    poses = 8  # in the strip, over one stride
    return np.linspace(start, end, poses).round().astype(np.int64)


def _configurations(robot: Robot, log: RobotLog, base_position: Array) -> Array:
    """Compute configurations of the tree, shape (T, 7 + n); the log's orientation may refer to another frame."""
    assert log.base_orientation is not None
    in_root, _ = frame_pose(robot.tree, robot.tree.model.getFrameId(robot.base_frame), log.position)
    rotation = Rotation.from_quat(log.base_orientation) * Rotation.from_matrix(in_root).inv()
    return np.hstack([base_position, rotation.as_quat(), log.position[:, robot.tree.columns]])
