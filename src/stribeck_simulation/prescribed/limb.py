"""Kinematics of one limb on a moving base, in the world: pose, velocity and acceleration of its end, and Jacobian.

It is written apart from `stribeck.robot.kinematics`, so that the truth of a simulated log does not rest on what is
tested with it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from stribeck.robot import Robot
from stribeck.typing import Array


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """Motion of a frame in the world, in the world's coordinates.

    Attributes
    ----------
    rotation, position
        Frame to world, shape (T, 3, 3), and its origin [m], shape (T, 3).
    velocity, acceleration
        Of the origin [m/s], [m/s^2], then angular [rad/s], [rad/s^2], shape (T, 6).
    """

    rotation: Array
    position: Array
    velocity: Array
    acceleration: Array

    def at_pace(self, pace: float) -> BodyMotion:
        """Return the same path, so many times as fast."""
        return BodyMotion(self.rotation, self.position, pace * self.velocity, pace**2 * self.acceleration)


@dataclass(frozen=True, eq=False)
class Limb:
    """The joints from the root link to a frame.

    Attributes
    ----------
    placements
        Of each joint in the one before, and last of the frame in the last joint; one more than joints.
    axes
        Unit vectors in the joints' own frames, shape (k, 3).
    prismatic
        Shape (k,).
    columns
        The robot's joints, shape (k,).
    """

    placements: list[pin.SE3]
    axes: Array
    prismatic: tuple[bool, ...]
    columns: NDArray[np.int64]


def limb_to(robot: Robot, frame_name: str) -> Limb:
    """Return the limb from the root link to a frame of a floating robot."""
    tree = robot.tree
    frame = tree.model.frames[tree.model.getFrameId(frame_name)]
    joints = tree.path_to_root(int(frame.parentJoint))[::-1]
    return Limb(
        placements=[*(tree.model.jointPlacements[joint] for joint in joints), frame.placement],
        axes=np.array([tree.axis(joint).direction for joint in joints]).reshape(-1, 3),
        prismatic=tuple(tree.axis(joint).prismatic for joint in joints),
        columns=np.array([tree.column(joint) for joint in joints], dtype=np.int64),
    )


def end_motion(
    limb: Limb, base: BodyMotion, position: Array, velocity: Array, acceleration: Array
) -> tuple[BodyMotion, Array]:
    """Return the motion of a limb's end and its Jacobian.

    Parameters
    ----------
    limb
        With k joints.
    base
        Motion of the root link at T samples.
    position, velocity, acceleration
        Of the limb's joints, shape (T, k).

    Returns
    -------
    end
        Motion of the frame.
    jacobian
        Of its velocity to the joints' velocities, shape (T, 6, k).
    """
    rotation, origin = base.rotation, base.position
    linear, omega = base.velocity[:, :3], base.velocity[:, 3:]
    change, alpha = base.acceleration[:, :3], base.acceleration[:, 3:]
    jacobian = np.zeros((len(position), 6, len(limb.columns)))
    origins = []
    for k, placement in enumerate(limb.placements):
        arm = rotation @ placement.translation
        if k and limb.prismatic[k - 1]:
            arm = arm + jacobian[:, :3, k - 1] * position[:, k - 1, None]
        swing = np.cross(omega, arm)
        linear, change = linear + swing, change + np.cross(alpha, arm) + np.cross(omega, swing)
        if k and limb.prismatic[k - 1]:
            slide = jacobian[:, :3, k - 1] * velocity[:, k - 1, None]
            linear = linear + slide
            change = change + 2 * np.cross(omega, slide) + jacobian[:, :3, k - 1] * acceleration[:, k - 1, None]
        origin, rotation = origin + arm, rotation @ placement.rotation
        if k == len(limb.columns):
            break
        origins.append(origin)
        axis = rotation @ limb.axes[k]
        if limb.prismatic[k]:
            jacobian[:, :3, k] = axis
        else:
            jacobian[:, 3:, k] = axis
            spin = axis * velocity[:, k, None]
            alpha = alpha + axis * acceleration[:, k, None] + np.cross(omega, spin)
            omega = omega + spin
            rotation = rotation @ Rotation.from_rotvec(position[:, k, None] * limb.axes[k]).as_matrix()
    for k, place in enumerate(origins):
        jacobian[:, :3, k] += np.cross(jacobian[:, 3:, k], origin - place)
    return BodyMotion(rotation, origin, np.hstack([linear, omega]), np.hstack([change, alpha])), jacobian
