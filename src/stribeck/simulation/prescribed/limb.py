"""Kinematics of a limb on a moving base, in the world: motion of its end, and joint motion for a fixed end.

The module is independent of `core.robot.kinematics`, so that the ground truth does not depend on the tested code.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError
from stribeck.core.robot import Contact, Robot

COARSE = 25
"""Stride of the samples that Newton's method solves first; a spline through them starts all other samples."""


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """Motion of a frame in the world, in world coordinates.

    Attributes
    ----------
    rotation, position
        Rotation from the frame to the world, shape (T, 3, 3), and its origin [m], shape (T, 3).
    velocity, acceleration
        Linear velocity and acceleration of the origin, then angular ones, shape (T, 6).
    """

    rotation: Array
    position: Array
    velocity: Array
    acceleration: Array


def at_rest(samples: int) -> BodyMotion:
    """Build a level body that rests at the world's origin."""
    turn = np.broadcast_to(np.eye(3), (samples, 3, 3))
    return BodyMotion(turn, np.zeros((samples, 3)), *np.zeros((2, samples, 6)))


@dataclass(frozen=True, eq=False)
class Limb:
    """The joints from the root link to a frame.

    Attributes
    ----------
    placements
        Placements of each joint in the previous joint, then of the frame in the last joint: k + 1.
    axes
        Axes as unit vectors in the joints' frames, shape (k, 3).
    prismatic
        Whether each joint is prismatic, shape (k,).
    columns
        Indices of the joints in the robot, shape (k,).
    """

    placements: list[pin.SE3]
    axes: Array
    prismatic: tuple[bool, ...]
    columns: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Leg:
    """A contact, its limb, and the pose of the standing foot: rotation (3, 3) and position (3,) [m]."""

    contact: Contact
    limb: Limb
    rotation: Array
    place: Array


def limb_to(robot: Robot, frame_name: str) -> Limb:
    """Build the limb from the root link to a frame of a floating robot."""
    tree = robot.tree
    frame = tree.model.frames[tree.model.getFrameId(frame_name)]
    joints = tree.path_to_root(int(frame.parentJoint))[::-1]
    return Limb(
        placements=[*(tree.model.jointPlacements[joint] for joint in joints), frame.placement],
        axes=np.array([tree.axis(joint).direction for joint in joints]).reshape(-1, 3),
        prismatic=tuple(tree.axis(joint).prismatic for joint in joints),
        columns=np.array([tree.column(joint) for joint in joints], dtype=np.int64),
    )


def end_motion(limb: Limb, base: BodyMotion, joints: Array) -> tuple[BodyMotion, Array]:
    """Compute the motion of a limb's end and its Jacobian.

    Parameters
    ----------
    limb
        Limb with k joints.
    base
        Motion of the root link at T samples.
    joints
        Trajectory of the limb's joints, shape (3, T, k).

    Returns
    -------
    end
        Motion of the frame.
    jacobian
        Jacobian from joint velocities to its velocity, shape (T, 6, k).
    """
    position, velocity, acceleration = joints
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


def place_end(leg: Leg, base: BodyMotion, start: Array) -> Array:
    """Compute joint positions that put a foot at its standing pose, by Newton's method, shape (T, k).

    Parameters
    ----------
    leg
        Leg with as many joints as the contact has constraints: a pose for a surface, a position for a point.
    base
        Motion of the root link at T samples.
    start
        Initial joint positions, shape (k,).

    Raises
    ------
    SettingsError
        If the limb cannot reach the pose.
    """
    position: Array = _start(leg, base, start)
    size = leg.contact.size
    for _ in range(60):
        end, jacobian = end_motion(leg.limb, base, _resting(position))
        turn = Rotation.from_matrix(leg.rotation @ end.rotation.transpose(0, 2, 1)).as_rotvec()
        error = np.hstack([leg.place - end.position, turn])
        try:
            step = np.linalg.solve(jacobian[:, :size], error[:, :size, None])[:, :, 0]
        except np.linalg.LinAlgError:
            break
        largest = np.abs(step).max(axis=1, keepdims=True)
        # limit of a Newton step [rad], for initial positions far from the solution
        position = position + step * np.minimum(1.0, 0.3 / np.maximum(largest, 1e-300))
        if largest.max() < 1e-13:  # [rad]; Newton's method converges quadratically
            return position
        if not np.abs(position).max() < 100:
            break
    raise SettingsError(
        f"posture: foot '{leg.contact.name}' cannot be put level on the ground near this posture; "
        "give a posture with bent knees and about level feet"
    )


def _start(leg: Leg, base: BodyMotion, start: Array) -> Array:
    """Compute joint positions near the solution, shape (T, k), by a spline through solutions at a stride."""
    samples = len(base.position)
    if samples < 100 * COARSE:  # short motions are solved without a spline
        return np.tile(start, (samples, 1))
    rows = np.append(np.arange(0, samples - 1, COARSE), samples - 1)
    some = BodyMotion(base.rotation[rows], base.position[rows], base.velocity[rows], base.acceleration[rows])
    return np.asarray(CubicSpline(rows, place_end(leg, some, start))(np.arange(samples)))


def _resting(position: Array) -> Array:
    return np.array([position, *np.zeros((2, *position.shape))])


def planted_motion(leg: Leg, base: BodyMotion, start: Array) -> Array:
    """Compute the joint motion that keeps a foot at its standing pose, shape (3, T, k).

    With the limb's Jacobian J, joint velocities v follow from `J v + (velocity due to the base) = 0`, accelerations a
    from `J a + J' v + (acceleration due to the base) = 0`. For the parameters, see `place_end`.
    """
    joints = _resting(place_end(leg, base, start))
    rows = slice(leg.contact.size)
    carried, jacobian = end_motion(leg.limb, base, joints)
    joints[1] = np.linalg.solve(jacobian[:, rows], -carried.velocity[:, rows, None])[:, :, 0]
    carried, _ = end_motion(leg.limb, base, joints)
    joints[2] = np.linalg.solve(jacobian[:, rows], -carried.acceleration[:, rows, None])[:, :, 0]
    return joints
