"""Exact logs: a prescribed smooth motion, and its torques from inverse dynamics and a known friction law.

The log is exact to rounding without integration or differentiation, so all errors are the estimator's errors.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from stribeck.core.base.typing import Array
from stribeck.core.friction import FrictionLaw
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.simulation.friction.parameters import Parameters, parameter_table
from stribeck.simulation.prescribed.gait import Gait, in_the_air, load_share, plan_swings
from stribeck.simulation.prescribed.ground import ground_reactions, inverse_dynamics, spatial_motion
from stribeck.simulation.prescribed.limb import BodyMotion, end_motion, limb_to
from stribeck.simulation.prescribed.motion import Motion, random_motion, sway_at
from stribeck.simulation.prescribed.tipping import keep_from_tipping


@dataclass(frozen=True, eq=False, kw_only=True)
class Truth:
    """Ground truth of a log.

    Attributes
    ----------
    friction_torque
        R(v), positive for positive velocity [N m], shape (T, n); zero for joints without parameters.
    parameters
        Parameters of the friction law, by joint and name.
    base_position, base_orientation
        Position of the root link in the world [m], shape (T, 3), and quaternion xyzw, shape (T, 4). All base channels
        are None for a fixed base.
    base_velocity, base_acceleration
        Linear and angular velocity of the root link in root link coordinates, and its derivative, shape (T, 6).
    foot_wrench
        Exact wrench of the ground on each foot, in its contact frame [N], [N m], shape (T, feet, 6); None without feet.
    """

    friction_torque: Array
    parameters: dict[str, dict[str, float]]
    base_position: Array | None = None
    base_orientation: Array | None = None
    base_velocity: Array | None = None
    base_acceleration: Array | None = None
    foot_wrench: Array | None = None


def exact_log(
    robot: Robot,
    law: FrictionLaw,
    parameters: Parameters,
    *,
    duration: float,
    rate: float = 1000.0,
    seed: int = 0,
    gait: Gait = "walk",
    posture: Mapping[str, float] | None = None,
    pace: float = 1.0,
) -> tuple[RobotLog, Truth]:
    """Build the log of a smooth random motion with exact velocity, acceleration and torque, and its truth.

    Parameters
    ----------
    robot
        Robot with a fixed base, or with feet at the ends of limbs with as many joints as the contact has constraints.
    law
        Friction law.
    parameters
        Parameters of the law, by joint and name; other joints have no friction.
    duration, rate
        Duration [s] and sampling rate [Hz].
    seed
        Seed of the random motion.
    gait
        Gait of a floating robot; ignored for a fixed one. The feet swing and return to the same place.
    posture
        Joint positions [rad or m] at the center of the motion; other joints stay near zero, away from their limits.
    pace
        Speed factor along the same path [1]. Use 1 for a trot; at other speeds, the robot would tip over.

    Raises
    ------
    SettingsError
        If a joint or parameter is unknown or missing, or the posture allows no stance.
    """
    time = np.arange(round(duration * rate)) / rate
    generator = np.random.default_rng(seed)
    path = pace * time
    swings = plan_swings(gait, tuple(robot.contacts), pace * duration) if robot.base == "floating" else ()
    motion = random_motion(robot, posture or {}, swings, generator)
    base = None
    if motion.sway is not None:
        shift = keep_from_tipping(motion, motion.sway).at(path) if gait == "trot" and swings else 0.0
        base = sway_at(motion.sway, path, shift)
    joints = np.array([1.0, pace, pace**2])[:, None, None] * motion.joints_at(path, base)
    base = base and replace(base, velocity=pace * base.velocity, acceleration=pace**2 * base.acceleration)
    friction = _friction_torque(robot, law, parameters, joints[1])
    wrench, torque = inverse_dynamics(robot, joints, base)
    known = {joint: dict(named) for joint, named in parameters.items()}
    log = RobotLog(
        time=time,
        joint_names=robot.joint_names,
        position=joints[0],
        velocity=joints[1],
        acceleration=joints[2],
        torque=torque + friction,
        torque_source=robot.torque_source,
    )
    if base is None:
        return log, Truth(friction_torque=friction, parameters=known)
    velocity, acceleration = spatial_motion(base)
    truth = Truth(
        friction_torque=friction,
        parameters=known,
        base_position=base.position,
        base_orientation=Rotation.from_matrix(base.rotation).as_quat(),
        base_velocity=velocity,
        base_acceleration=acceleration,
    )
    return _on_feet(log, path, motion, joints, base, wrench), truth


def _friction_torque(robot: Robot, law: FrictionLaw, parameters: Parameters, velocity: Array) -> Array:
    """Compute R(v) of all joints [N m], shape (T, n); zero for joints without parameters."""
    columns, values = parameter_table(robot.joint_names, law.name, law.parameters, parameters)
    friction = np.zeros_like(velocity)
    for k, column in enumerate(columns):
        friction[:, column] = law.torque(velocity[:, column], values[:, k])
    return friction


def _on_feet(log: RobotLog, path: Array, motion: Motion, joints: Array, base: BodyMotion, wrench: Array) -> RobotLog:
    """Subtract the torques of the ground reaction from a log, and add the channels of base and feet."""
    names = tuple(leg.contact.name for leg in motion.legs)
    share = np.column_stack([load_share(motion.swings, name, path) for name in names])
    standing = ~np.column_stack([in_the_air(motion.swings, name, path) for name in names])
    reactions, effect = ground_reactions(motion.legs, joints, base, wrench, share, standing)
    return replace(
        log,
        torque=log.torque - effect,
        base_orientation=_base_orientation(motion.robot, joints, base),
        foot_names=names,
        contact=standing,
        foot_wrench=reactions,
    )


def _base_orientation(robot: Robot, joints: Array, base: BodyMotion) -> Array:
    """Compute quaternions xyzw of the base frame of the robot's logs, shape (T, 4)."""
    limb = limb_to(robot, robot.base_frame)
    frame, _ = end_motion(limb, base, joints[:, :, limb.columns])
    return np.asarray(Rotation.from_matrix(frame.rotation).as_quat())
