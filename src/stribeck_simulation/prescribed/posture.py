"""The posture a simulated robot moves about: given, or well within the joint limits, with level feet at one height."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from stribeck.errors import SettingsError
from stribeck.robot import Contact, Robot
from stribeck.typing import Array
from stribeck_simulation.prescribed.limb import BodyMotion, Limb, limb_to
from stribeck_simulation.prescribed.planted import place_end


@dataclass(frozen=True, eq=False)
class Leg:
    """A contact, the limb to it, and the pose of the foot when it stands: rotation (3, 3) and place (3,) [m]."""

    contact: Contact
    limb: Limb
    rotation: Array
    place: Array


def default_posture(robot: Robot, posture: Mapping[str, float]) -> Array:
    """Return the given joint positions, and elsewhere the ones nearest to zero that keep off the limits, shape (n,).

    Raises
    ------
    SettingsError
        If the posture names a joint that the robot does not have, or is beyond a limit.
    """
    low, high = robot.position_limits
    # share of its range that a joint keeps off its limits where no posture is given: knees are bent then
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
    """Level the feet of a floating robot and put them on the ground, z = 0.

    Parameters
    ----------
    robot
        With contacts, each at the end of a limb of its own with as many joints as the contact has constraints.
    posture
        Joint positions about which to look, shape (n,).

    Returns
    -------
    posture
        With the legs moved so that surfaces are level and all feet at one height.
    height
        Of the root link above the ground [m].
    legs
        With their standing poses.

    Raises
    ------
    SettingsError
        If there are no contacts, a limb has another number of joints, or no such posture is near.
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
    base = _base_at(0.0)
    poses = {name: robot.foot_pose(name, posture[None]) for name in limbs}
    height = -float(np.mean([place[0, 2] for _, place in poses.values()]))
    posture, legs = posture.copy(), []
    for name, limb in limbs.items():
        rotation, place = poses[name][0][0], poses[name][1][0] * (1, 1, 0) - (0, 0, height)
        if robot.contacts[name].kind == "surface":
            yaw = np.arctan2(rotation[1, 0], rotation[0, 0])
            rotation = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
        leg = Leg(robot.contacts[name], limb, rotation, place)
        posture[limb.columns] = place_end(limb, leg.contact, base, rotation, place, posture[limb.columns])[0]
        legs.append(Leg(leg.contact, limb, rotation, place + np.array([0, 0, height])))
    return posture, height, legs


def _base_at(height: float) -> BodyMotion:
    """Return a level base at rest, one sample."""
    return BodyMotion(np.eye(3)[None], np.array([[0, 0, height]]), *np.zeros((2, 1, 6)))
