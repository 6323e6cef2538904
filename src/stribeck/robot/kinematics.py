"""Vectorised kinematics of chains of one-degree-of-freedom joints: all samples at once, in numpy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stribeck.robot.rooting import RootedModel
from stribeck.typing import Array


def rotate(axis: Array, angle: Array, vectors: Array) -> Array:
    """Rotate vectors about a unit axis (Rodrigues).

    Parameters
    ----------
    axis
        Unit vector, shape (3,).
    angle
        [rad], shape (T,).
    vectors
        Shape (T, 3).
    """
    sine, cosine = np.sin(angle)[:, None], np.cos(angle)[:, None]
    along = (vectors @ axis)[:, None] * axis
    return cosine * (vectors - along) + sine * np.cross(axis, vectors) + along


def rotation_matrices(axis: Array, angle: Array) -> Array:
    """Return the rotations about a unit axis, shape (T, 3, 3)."""
    skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    sine, cosine = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.asarray(np.eye(3) + sine * skew + (1 - cosine) * (skew @ skew))


def direction_in_root(rooted: RootedModel, frame: int, position: Array, direction: Array) -> Array:
    """Return directions given in a frame, shape (T, 3), in the root's coordinates.

    Parameters
    ----------
    rooted
        The tree.
    frame
        Index of the frame in `rooted.model`.
    position
        The robot's joint positions, shape (T, n).
    direction
        Vectors in the frame, shape (T, 3).
    """
    placed = rooted.model.frames[frame]
    vectors = direction @ placed.placement.rotation.T
    for joint in rooted.path_to_root(int(placed.parentJoint)):
        axis = rooted.axis(joint)
        if not axis.prismatic:
            vectors = rotate(axis.direction, position[:, rooted.column(joint)], vectors)
        vectors = vectors @ rooted.model.jointPlacements[joint].rotation.T
    return np.asarray(vectors)


def frame_pose(rooted: RootedModel, frame: int, position: Array) -> tuple[Array, Array]:
    """Return rotation (T, 3, 3) and translation (T, 3) of a frame in the root's coordinates."""
    placed = rooted.model.frames[frame]
    samples = len(position)
    rotation = np.broadcast_to(placed.placement.rotation, (samples, 3, 3))
    translation = np.broadcast_to(placed.placement.translation, (samples, 3))
    for joint in rooted.path_to_root(int(placed.parentJoint)):
        axis, angle = rooted.axis(joint), position[:, rooted.column(joint)]
        placement = rooted.model.jointPlacements[joint]
        if axis.prismatic:
            translation = translation + angle[:, None] * axis.direction
        else:
            turn = rotation_matrices(axis.direction, angle)
            rotation = turn @ rotation
            translation = np.einsum("tij,tj->ti", turn, translation)
        rotation = placement.rotation @ rotation
        translation = translation @ placement.rotation.T + placement.translation
    return np.asarray(rotation), np.asarray(translation)


@dataclass(frozen=True, eq=False)
class PointMotion:
    """A point's position, velocity and acceleration relative to the root, in the root's coordinates, each (T, 3)."""

    position: Array
    velocity: Array
    acceleration: Array


def point_motion(rooted: RootedModel, frame: int, position: Array, velocity: Array, acceleration: Array) -> PointMotion:
    """Return the motion of a frame's origin as seen from the root, as if the root did not move.

    Velocities and accelerations add up joint by joint outwards; each array is (T, n) in the robot's joint order.
    """
    model = rooted.model
    samples = len(position)
    turn = np.broadcast_to(np.eye(3), (samples, 3, 3))
    origin, point_v, point_a = np.zeros((3, samples, 3))
    omega, alpha = np.zeros((2, samples, 3))
    joints = rooted.path_to_root(int(model.frames[frame].parentJoint))[::-1]
    steps = [(model.jointPlacements[joint], joint) for joint in joints] + [(model.frames[frame].placement, None)]
    for placement, joint in steps:
        arm = turn @ placement.translation
        point_v, point_a = _carry(arm, omega, alpha, point_v, point_a)
        origin = origin + arm
        turn = turn @ placement.rotation
        if joint is None:
            break
        axis, column = rooted.axis(joint), rooted.column(joint)
        direction = turn @ axis.direction
        rate, change = velocity[:, column, None], acceleration[:, column, None]
        if axis.prismatic:
            arm = direction * position[:, column, None]
            point_v, point_a = _carry(arm, omega, alpha, point_v, point_a)
            origin = origin + arm
            point_a = point_a + direction * change + 2 * np.cross(omega, direction * rate)
            point_v = point_v + direction * rate
        else:
            alpha = alpha + direction * change + np.cross(omega, direction * rate)
            omega = omega + direction * rate
            turn = turn @ rotation_matrices(axis.direction, position[:, column])
    return PointMotion(origin, point_v, point_a)


def _carry(arm: Array, omega: Array, alpha: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array]:
    """Move velocity and acceleration along an arm fixed to a body that turns with omega and alpha."""
    swing = np.cross(omega, arm)
    return velocity + swing, acceleration + np.cross(alpha, arm) + np.cross(omega, swing)
