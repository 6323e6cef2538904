"""Prescribed motion of a simulated robot: smooth random motion of base, arms and legs around a posture."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError
from stribeck.core.robot import Robot
from stribeck.simulation.prescribed.gait import Swing, swing_window
from stribeck.simulation.prescribed.limb import (
    BodyMotion,
    Leg,
    Limb,
    at_rest,
    end_motion,
    limb_to,
    place_end,
    planted_motion,
)
from stribeck.simulation.prescribed.trajectory import Sines, product, random_sines

FREE, SWAYING = (0.2, 2.0), (0.2, 1.0)
"""Lowest and highest frequency of free joints and of the base [Hz]."""

_GIMBAL = Limb(
    placements=[pin.SE3.Identity()] * 7,
    axes=np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1], [0, 1, 0], [1, 0, 0]]),
    prismatic=(True, True, True, False, False, False),
    columns=np.arange(6),
)
"""Limb from the world to the base: three slides along the world's axes, then yaw, pitch and roll."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Prescribed motion of a robot as a function of time.

    Attributes
    ----------
    free
        Free motion of all joints; swinging legs add it to the planted motion.
    posture
        Joint positions at the center of the motion, shape (n,).
    sway
        Motion of a floating base: position along x, y, z [m], then yaw, pitch and roll [rad].
    legs, swings
        Legs of a floating base, and the swings of their feet.
    """

    robot: Robot
    free: Sines
    posture: Array
    sway: Sines | None = None
    legs: tuple[Leg, ...] = ()
    swings: tuple[Swing, ...] = ()

    def joints_at(self, time: Array, base: BodyMotion | None) -> Array:
        """Compute the joints' motion at these times [s], for this motion of the base, shape (3, T, n)."""
        joints = self.free.at(time)
        if base is None:
            return joints
        for leg in self.legs:
            columns = leg.limb.columns
            swinging = product(joints[:, :, columns], swing_window(self.swings, leg.contact.name, time))
            joints[:, :, columns] = planted_motion(leg, base, self.posture[columns]) + swinging
        return joints


def sway_at(sway: Sines, time: Array, shift: Array | float = 0.0) -> BodyMotion:
    """Compute the base's motion at these times [s], moved by the trajectory `shift` [m], shape (3, T, 3)."""
    pose = sway.at(time)
    pose[:, :, :3] += shift
    return end_motion(_GIMBAL, at_rest(len(time)), pose)[0]


def random_motion(
    robot: Robot, posture: Mapping[str, float], swings: tuple[Swing, ...], generator: np.random.Generator
) -> Motion:
    """Draw a smooth random motion; see `Motion`.

    Raises
    ------
    SettingsError
        If the robot has no joint of the posture, or its feet cannot stand.
    """
    centre = default_posture(robot, posture)
    # speed limit of prismatic [m/s] and revolute joints [rad/s]; motions reach about 0.7 of it
    speed = np.where(robot.prismatic, 0.7, 2.8)
    if robot.base == "fixed":
        return Motion(robot, random_sines(centre, _room(robot, centre), speed, FREE, generator), centre)
    centre, height, legs = stand(robot, centre)
    free = random_sines(centre.copy(), _room(robot, centre), speed, FREE, generator)
    # swinging limbs move faster [Hz], and stay within 0.4 rad of the planted limb
    swing = random_sines(np.zeros(len(centre)), np.full(len(centre), 0.4), speed, (0.6, 2.0), generator)
    for leg in legs:
        for signal, replacement in ((free.amplitude, swing.amplitude), (free.pulsation, swing.pulsation)):
            signal[:, leg.limb.columns] = replacement[:, leg.limb.columns]
        free.centre[leg.limb.columns] = 0.0
    # the base sways by up to 3 % of its height above the feet, and 0.06 rad about each axis
    reach = np.repeat([0.03 * height, 0.06], 3)
    middle = np.array([0, 0, height, 0, 0, 0])
    sway = random_sines(middle, reach, 2 * np.pi * SWAYING[1] * reach, SWAYING, generator)
    return Motion(robot, free, centre, sway, tuple(legs), swings)


def _room(robot: Robot, centre: Array) -> Array:
    """Compute the amplitude that the joint limits allow [rad] or [m], shape (n,)."""
    low, high = robot.position_limits
    # largest motion, relative to the distance from the posture to the nearer limit
    room = 0.9 * np.minimum(high - centre, centre - low)
    return np.asarray(np.where(np.isfinite(room), np.maximum(room, 0.0), 2 * np.pi))


def default_posture(robot: Robot, posture: Mapping[str, float]) -> Array:
    """Complete a posture by positions that are near zero but away from the limits, shape (n,).

    Raises
    ------
    SettingsError
        If the posture has an unknown joint, or exceeds a limit.
    """
    low, high = robot.position_limits
    # joints without a given position stay a quarter of the range away from their limits, so that knees are flexed
    margin = np.where(np.isfinite(high - low), 0.25 * (high - low), 0.0)
    centre = np.clip(0.0, low + margin, high - margin)
    for name, value in posture.items():
        if name not in robot.joint_names:
            raise SettingsError(f"posture: robot has no joint '{name}'; it has {', '.join(robot.joint_names)}")
        joint = robot.joint_names.index(name)
        if not low[joint] <= value <= high[joint]:
            raise SettingsError(
                f"posture: joint '{name}' is at {value:g}; expected a value from {low[joint]:g} to {high[joint]:g}"
            )
        centre[joint] = value
    return np.asarray(centre)


def stand(robot: Robot, posture: Array) -> tuple[Array, float, list[Leg]]:
    """Place the level feet of a floating robot on the ground, z = 0.

    Parameters
    ----------
    robot
        Robot with contacts, each at the end of a separate limb with as many joints as the contact has constraints.
    posture
        Joint positions near the solution, shape (n,).

    Returns
    -------
    posture
        Posture in which surfaces are level and all feet have the same height.
    height
        Height of the root link above the ground [m].
    legs
        Legs with their standing poses.

    Raises
    ------
    SettingsError
        If the robot has no contacts, a limb has a wrong number of joints, or no solution is near the posture.
    """
    if not robot.contacts:
        raise SettingsError(f"{robot.path}: a floating robot needs [contacts] to stand on; there are none")
    limbs = {name: limb_to(robot, contact.frame) for name, contact in robot.contacts.items()}
    for name, limb in limbs.items():
        if len(limb.columns) != robot.contacts[name].size:
            raise SettingsError(
                f"{robot.path}: {len(limb.columns)} joints lead to contact '{name}', "
                f"expected {robot.contacts[name].size} for a {robot.contacts[name].kind} contact, to place it exactly"
            )
    poses = {name: robot.foot_pose(name, posture[None]) for name in limbs}
    height = -float(np.mean([place[0, 2] for _, place in poses.values()]))
    posture, legs = posture.copy(), []
    for name, limb in limbs.items():
        rotation, place = poses[name][0][0], poses[name][1][0] * (1, 1, 0) - (0, 0, height)
        if robot.contacts[name].kind == "surface":
            yaw = np.arctan2(rotation[1, 0], rotation[0, 0])
            rotation = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
        leg = Leg(robot.contacts[name], limb, rotation, place)
        posture[limb.columns] = place_end(leg, at_rest(1), posture[limb.columns])[0]
        legs.append(replace(leg, place=place + np.array([0, 0, height])))
    return posture, height, legs
