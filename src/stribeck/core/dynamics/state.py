"""Motion of the robot at some samples: joints, and orientation of the root link."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.robot import Robot
from stribeck.core.robot.kinematics import frame_pose
from stribeck.core.robot.rooting import BASE_FRAME


@dataclass(frozen=True, eq=False)
class Orientation:
    """Orientation of the root link and its rates, in link coordinates.

    Attributes
    ----------
    quaternion
        Quaternion xyzw from root link to world, shape (T, 4).
    angular_velocity, angular_acceleration
        Rates [rad/s], [rad/s^2], shape (T, 3).
    apparent_gravity
        Gravity minus the link's acceleration [m/s^2], shape (T, 3); None if not measured or not needed.
    """

    quaternion: Array
    angular_velocity: Array
    angular_acceleration: Array
    apparent_gravity: Array | None = None


@dataclass(frozen=True, eq=False)
class State:
    """Motion at T samples: joint position, velocity and acceleration, shape (T, n), and the root link's orientation."""

    position: Array
    velocity: Array
    acceleration: Array
    orientation: Orientation | None = None

    def take(self, rows: slice | IntArray | BoolArray) -> State:
        """Select samples."""
        turn = self.orientation
        if turn is not None:
            apparent = None if turn.apparent_gravity is None else turn.apparent_gravity[rows]
            rates = turn.angular_velocity[rows], turn.angular_acceleration[rows]
            turn = Orientation(turn.quaternion[rows], *rates, apparent)
        return State(self.position[rows], self.velocity[rows], self.acceleration[rows], turn)


def orientation_from_derivatives(quaternion: Array, rate: Array, change: Array) -> Orientation:
    """Compute orientation, angular velocity and angular acceleration from a quaternion and its two time derivatives.

    With q the unit quaternion, the angular velocity is the vector part of `2 q* q'`, and the angular acceleration the
    vector part of `2 q* q''`, both in the moving frame. Each array is (T, 4); the quaternion is normalized.
    """
    unit = quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
    return Orientation(unit, 2 * _conjugate_product(unit, rate), 2 * _conjugate_product(unit, change))


def _conjugate_product(a: Array, b: Array) -> Array:
    """Compute the vector part of a* b, shape (T, 3)."""
    return np.asarray(a[:, 3:] * b[:, :3] - b[:, 3:] * a[:, :3] - np.cross(a[:, :3], b[:, :3]))


def apparent_gravity(robot: Robot, position: Array, linear_acceleration: Array) -> Array:
    """Transform an accelerometer's reading to gravity minus acceleration in the root link, shape (T, 3)."""
    if robot.base_frame == BASE_FRAME:
        return -linear_acceleration
    rotation, _ = frame_pose(robot.tree, robot.tree.model.getFrameId(robot.base_frame), position)
    return np.asarray(-np.einsum("tij,tj->ti", rotation, linear_acceleration))


def root_quaternions(robot: Robot, position: Array, base_orientation: Array) -> Array:
    """Convert the base frame's quaternions to the root link's, continuous in sign, shape (T, 4)."""
    from scipy.spatial.transform import Rotation

    quaternions = base_orientation
    if robot.base_frame != BASE_FRAME:
        frame = robot.tree.model.getFrameId(robot.base_frame)
        rotation, _ = frame_pose(robot.tree, frame, position)
        quaternions = (Rotation.from_quat(quaternions) * Rotation.from_matrix(rotation).inv()).as_quat()
    return continuous(quaternions)


def continuous(quaternions: Array) -> Array:
    """Normalize quaternions, and choose their signs such that they change continuously, shape (T, 4)."""
    unit = quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)
    flips = np.where(np.sum(unit[1:] * unit[:-1], axis=1) < 0, -1.0, 1.0)
    return np.asarray(unit * np.concatenate([[1.0], np.cumprod(flips)])[:, None])
