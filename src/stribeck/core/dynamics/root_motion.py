"""Motion and tilt of the root of the tree, from standing feet, base orientation and joints."""

from dataclasses import replace

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.dynamics.rooted import RootMotion, inertia_matrix, rooted_inverse_dynamics
from stribeck.core.dynamics.state import Orientation, State
from stribeck.core.errors import LogError
from stribeck.core.robot import Robot
from stribeck.core.robot.kinematics import PointMotion, direction_in_root, point_motion
from stribeck.core.robot.rooting import BASE_FRAME, RootedModel

ENOUGH_POINTS = 3
"""Number of standing points that determine all six degrees of freedom of the base."""


def gravity_in_root_link(quaternion: Array, gravity: Array) -> Array:
    """Transform gravity to root link coordinates, shape (T, 3), with the link's orientation xyzw, shape (T, 4)."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_quat(quaternion).apply(gravity, inverse=True))


def standing_root(robot: Robot, contact: str, state: State) -> RootMotion:
    """Compute the root motion of the tree rooted at a standing surface: at rest, tilted as the IMU measures, or flat.

    Without an orientation in `state`, the foot's z axis points up.
    """
    if state.orientation is None:
        return RootMotion(np.broadcast_to(robot.gravity, (len(state.position), 3)))
    rooted = robot.rooted_at(contact)
    gravity = gravity_in_root_link(state.orientation.quaternion, robot.gravity)
    frame = rooted.model.getFrameId(BASE_FRAME)
    return RootMotion(direction_in_root(rooted, frame, state.position, gravity))


def base_root(robot: Robot, feet: tuple[str, ...], state: State) -> RootMotion:
    """Compute the motion of the root link of a robot on point feet that neither slip nor lift.

    With p a standing point in root link coordinates, w the link's angular velocity, W the foot's, and u up, the point
    is the center of a ball of radius r that rolls:

        v + w x p + p' = r W x u
        A + w' x p + w x (w x p) + 2 w x p' + p'' = r W' x u

    The base orientation gives w and w', because points slip. Where it is known only at one instant, so that w = 0,
    three points give v, A, w and w' by least squares.

    Raises
    ------
    LogError
        If the base orientation is missing, which gives the tilt.
    """
    turn = state.orientation
    if turn is None:
        raise LogError(
            f"log: {'+'.join(feet)} are point feet, which do not determine the tilt of the base; "
            "expected a channel base_orientation"
        )
    gravity = gravity_in_root_link(turn.quaternion, robot.gravity)
    omega, alpha = turn.angular_velocity, turn.angular_acceleration
    motion = state.position, state.velocity, state.acceleration
    frames = [robot.tree.model.getFrameId(robot.contacts[foot].frame) for foot in feet]
    points = [point_motion(robot.tree, frame, *motion) for frame in frames]
    up = gravity_in_root_link(turn.quaternion, robot.up)
    points = [_roll(point, robot.contacts[foot].radius * up, turn) for point, foot in zip(points, feet, strict=True)]
    if len(points) >= ENOUGH_POINTS and not omega.any():
        twist = _solve_twist(points, [-point.velocity for point in points])
        velocity, omega = twist[:, :3], twist[:, 3:]
        change = _solve_twist(points, [-_compute_apparent_acceleration(point, omega) for point in points])
        linear, alpha = change[:, :3], change[:, 3:]
    else:
        velocity = -np.mean([point.velocity + np.cross(omega, point.position) for point in points], axis=0)
        linear = -np.mean(
            [_compute_apparent_acceleration(point, omega) + np.cross(alpha, point.position) for point in points], axis=0
        )
    return RootMotion(
        gravity=gravity,
        velocity=np.hstack([velocity, omega]),
        acceleration=np.hstack([linear - np.cross(omega, velocity), alpha]),
    )


def hung_root(robot: Robot, state: State, gyroscope: bool = False) -> RootMotion:
    """Compute the motion of the root link of a robot that hangs, or rolls on wheels.

    Without a gyroscope, it turns at the measured, nearly constant speed: its angular acceleration is smaller than the
    noise of a measured one. The accelerometer gives gravity minus the linear acceleration; without it, the link stays
    in place.

    Raises
    ------
    LogError
        If the base orientation is missing.
    """
    turn = state.orientation
    if turn is None:
        raise LogError("log: the base hangs freely, and its tilt is not used; expected base_orientation and tilt 'imu'")
    gravity = turn.apparent_gravity
    if gravity is None:
        gravity = gravity_in_root_link(turn.quaternion, robot.gravity)
    still = np.zeros_like(turn.angular_velocity)
    acceleration = np.hstack([still, turn.angular_acceleration]) if gyroscope else None
    return RootMotion(gravity, np.hstack([still, turn.angular_velocity]), acceleration)


def flying_root(rooted: RootedModel, state: State) -> RootMotion:
    """Compute the motion of the root link of a flying robot: no wrench acts on it.

    The link rotates with the base orientation, and accelerates such that inverse dynamics yields no wrench. Its linear
    velocity is arbitrary, and zero here.
    """
    turn = state.orientation
    assert turn is not None
    velocity = np.hstack([np.zeros_like(turn.angular_velocity), turn.angular_velocity])
    gravity = np.zeros_like(turn.angular_velocity)  # accelerations are relative to free fall
    motion = state.position, state.velocity, state.acceleration
    wrench = rooted_inverse_dynamics(rooted, *motion, RootMotion(gravity, velocity))[0]
    inertia = inertia_matrix(rooted, state.position)[:, :6, :6]
    acceleration = np.asarray(np.linalg.solve(inertia, -wrench[:, :, None])[:, :, 0], dtype=np.float64)
    return RootMotion(gravity, velocity, acceleration)


def _roll(point: PointMotion, lever: Array, turn: Orientation) -> PointMotion:
    """Subtract the motion of a rolling center, `lever` above the ground (T, 3), so that the point is at rest."""
    omega = turn.angular_velocity
    spin = omega + point.turning
    spin_rate = turn.angular_acceleration + np.cross(omega, point.turning) + point.turning_rate
    velocity = point.velocity - np.cross(spin, lever)
    acceleration = point.acceleration - np.cross(spin_rate, lever) + 2 * np.cross(omega, np.cross(spin, lever))
    return replace(point, velocity=velocity, acceleration=acceleration)


def _compute_apparent_acceleration(point: PointMotion, omega: Array) -> Array:
    """Compute a point's acceleration in a link that rotates with omega, without the link's acceleration, (T, 3)."""
    centripetal = np.cross(omega, np.cross(omega, point.position))
    return np.asarray(point.acceleration + 2 * np.cross(omega, point.velocity) + centripetal)


def _solve_twist(points: list[PointMotion], right: list[Array]) -> Array:
    """Solve x + y x p = b over all points for (x, y), shape (T, 6)."""
    matrix = np.zeros((len(points[0].position), 3 * len(points), 6))
    for k, point in enumerate(points):
        x, y, z = point.position.T
        rows = matrix[:, 3 * k : 3 * k + 3]
        rows[:, :, :3] = np.eye(3)
        rows[:, 0, 4], rows[:, 0, 5] = z, -y
        rows[:, 1, 3], rows[:, 1, 5] = -z, x
        rows[:, 2, 3], rows[:, 2, 4] = y, -x
    transposed = matrix.transpose(0, 2, 1)
    vector = np.hstack(right)[:, :, None]
    return np.asarray(np.linalg.solve(transposed @ matrix, transposed @ vector)[:, :, 0])
