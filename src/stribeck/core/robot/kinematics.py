"""Vectorized kinematics of joint chains, for all samples at once."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array
from stribeck.core.robot.rooting import Axis, RootedModel


def _rotate(axis: Array, angle: Array, vectors: Array) -> Array:
    """Rotate vectors, shape (T, 3), about a unit axis by angles [rad], shape (T, 1), with Rodrigues' formula."""
    along = (vectors @ axis)[:, None] * axis
    return np.asarray(along + np.cos(angle) * (vectors - along) + np.sin(angle) * (vectors @ pin.skew(axis).T))


def _walk_to_root(rooted: RootedModel, frame: int) -> Iterator[tuple[Axis, int, pin.SE3]]:
    """Yield axis, column and placement of the joints from a frame to the root."""
    for joint in rooted.path_to_root(int(rooted.model.frames[frame].parentJoint)):
        yield rooted.axis(joint), rooted.column(joint), rooted.model.jointPlacements[joint]


def link_of(tree: RootedModel, joint: int) -> pin.Frame:
    """Find the link behind a joint of a tree, preferably the one that carries tools."""
    frames = [frame for frame in tree.model.frames if frame.parentJoint == joint]
    links = [frame for frame in frames if frame.type == pin.FrameType.BODY]
    tools = ("tool", "tcp", "flange", "hand", "gripper", "end_effector", "ee_")
    return next((frame for frame in links if any(word in frame.name.lower() for word in tools)), (links or frames)[0])


def direction_in_root(rooted: RootedModel, frame: int, position: Array, direction: Array) -> Array:
    """Transform directions from a frame to the root's coordinates, shape (T, 3).

    Parameters
    ----------
    rooted
        Rooted tree.
    frame
        Index of the frame in `rooted.model`.
    position
        Joint positions of the robot, shape (T, n).
    direction
        Directions in the frame, shape (T, 3).
    """
    direction = direction @ rooted.model.frames[frame].placement.rotation.T
    for axis, column, placement in _walk_to_root(rooted, frame):
        if not axis.prismatic:
            direction = _rotate(axis.direction, position[:, column, None], direction)
        direction = direction @ placement.rotation.T
    return direction


def frame_pose(rooted: RootedModel, frame: int, position: Array) -> tuple[Array, Array]:
    """Compute rotation (T, 3, 3) and translation (T, 3) of a frame in the root's coordinates."""
    from scipy.spatial.transform import Rotation

    pose = rooted.model.frames[frame].placement
    rotation = np.broadcast_to(pose.rotation, (len(position), 3, 3))
    translation = np.tile(pose.translation, (len(position), 1))  # SciPy requires a writable array
    for axis, column, placement in _walk_to_root(rooted, frame):
        angle = position[:, column]
        if axis.prismatic:
            translation = translation + angle[:, None] * axis.direction
        else:
            turn = Rotation.from_rotvec(angle[:, None] * axis.direction)
            rotation, translation = turn.as_matrix() @ rotation, turn.apply(translation)
        rotation = placement.rotation @ rotation
        translation = translation @ placement.rotation.T + placement.translation
    return np.asarray(rotation), np.asarray(translation)


def joint_torque_of_wrench(rooted: RootedModel, frame: int, position: Array, wrench: Array) -> Array:
    """Compute J^T w, the joint torques of a wrench on a frame while the root is fixed, (T, n) in robot order.

    Parameters
    ----------
    rooted, frame, position
        Tree, frame and joint positions, see `direction_in_root`.
    wrench
        Force [N] and moment [N m] at the frame's origin, in its coordinates, shape (T, 6).
    """
    from scipy.spatial.transform import Rotation

    force, moment = _transform_wrench(rooted.model.frames[frame].placement, wrench[:, :3], wrench[:, 3:])
    torque = np.zeros_like(position)
    for axis, column, placement in _walk_to_root(rooted, frame):
        torque[:, column] = (force if axis.prismatic else moment) @ axis.direction
        if axis.prismatic:
            moment = moment + np.cross(position[:, column, None] * axis.direction, force)
        else:
            turn = Rotation.from_rotvec(position[:, column, None] * axis.direction)
            force, moment = turn.apply(force), turn.apply(moment)
        force, moment = _transform_wrench(placement, force, moment)
    return torque


def _transform_wrench(placement: pin.SE3, force: Array, moment: Array) -> tuple[Array, Array]:
    """Transform force and moment, shape (T, 3) each, from a frame to the frame that it is placed in."""
    force = force @ placement.rotation.T
    return force, moment @ placement.rotation.T + np.cross(placement.translation, force)


@dataclass(frozen=True, eq=False)
class PointMotion:
    """Motion of a frame's origin relative to the root, in its coordinates, shape (T, 3) each.

    Attributes
    ----------
    position, velocity, acceleration
        Of the origin [m], [m/s], [m/s^2].
    turning, turning_rate
        Angular velocity and acceleration of the frame [rad/s], [rad/s^2].
    """

    position: Array
    velocity: Array
    acceleration: Array
    turning: Array
    turning_rate: Array


def point_motion(rooted: RootedModel, frame: int, position: Array, velocity: Array, acceleration: Array) -> PointMotion:
    """Compute the motion of a frame relative to the root.

    Each array is (T, n) in robot order. From a joint's child to its parent, with axis u and rotation R,

        p -> R p,    p' -> R (p' + q' u x p),    p'' -> R (p'' + 2 q' u x p' + q'' u x p + q'^2 u x (u x p))
        w -> R w + q' u,    w' -> R (w' + q' u x w) + q'' u
    """
    point = np.tile(rooted.model.frames[frame].placement.translation, (len(position), 1))
    rate, change, turning, turning_rate = np.zeros((4, *point.shape))
    for about, column, placement in _walk_to_root(rooted, frame):
        axis = about.direction
        q, dq, ddq = (motion[:, column, None] for motion in (position, velocity, acceleration))
        if about.prismatic:
            point, rate, change = point + q * axis, rate + dq * axis, change + ddq * axis
        else:
            cross = pin.skew(axis).T  # u x p = p @ cross, for all samples at once
            swept = point @ cross
            change = change + 2 * dq * (rate @ cross) + ddq * swept + dq**2 * (swept @ cross)
            vectors = point, rate + dq * swept, change, turning, turning_rate + dq * (turning @ cross)
            point, rate, change, turning, turning_rate = (_rotate(axis, q, vector) for vector in vectors)
            turning, turning_rate = turning + dq * axis, turning_rate + ddq * axis
        point = point @ placement.rotation.T + placement.translation
        rates = rate, change, turning, turning_rate
        rate, change, turning, turning_rate = (vector @ placement.rotation.T for vector in rates)
    return PointMotion(point, rate, change, turning, turning_rate)
