"""Initial stance of a walk."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError
from stribeck.core.robot import Robot
from stribeck.simulation.prescribed.motion import default_posture, stand
from stribeck.simulation.walking.balance.terms import Dynamics
from stribeck.simulation.walking.footsteps import FEET, Footprint


@dataclass(frozen=True, eq=False)
class Start:
    """Initial stance on both feet.

    Attributes
    ----------
    configuration
        Configuration of Pinocchio's rooted tree, with soles at z = 0.
    feet
        Footprints at the centers of the soles.
    height
        Height of the center of mass [m].
    """

    configuration: Array
    feet: tuple[Footprint, Footprint]
    height: float

    @property
    def posture(self) -> Array:
        """Joint positions in the tree's order, shape (n,)."""
        return self.configuration[7:]


def start_standing(robot: Robot, dynamics: Dynamics, posture: Mapping[str, float]) -> Start:
    """Place the robot in a posture with level feet.

    Parameters
    ----------
    robot
        Robot with a floating base and two surface contacts.
    dynamics
        Model of the robot with soles.
    posture
        Joint positions by name [rad]. Knees should be bent enough for the steps, but not more than their torque allows.

    Raises
    ------
    SettingsError
        If the robot does not have two flat feet, or the posture allows no stance.
    """
    kinds = [contact.kind for contact in robot.contacts.values()]
    if kinds != ["surface"] * FEET:
        raise SettingsError(
            f"{robot.path}: walking needs two contacts of kind 'surface'; found {', '.join(kinds) or 'none'}"
        )
    joints, height, _ = stand(robot, default_posture(robot, posture))
    configuration = np.concatenate([[0, 0, height, 0, 0, 0, 1], joints[robot.tree.columns]])
    rest = np.zeros(dynamics.model.nv)
    feet = dynamics.at(configuration, rest).feet
    configuration[2] -= min(foot.place[2] for foot in feet)
    prints = [
        Footprint(
            float(foot.place[0]), float(foot.place[1]), float(np.arctan2(foot.rotation[1, 0], foot.rotation[0, 0]))
        )
        for foot in feet
    ]
    return Start(configuration, (prints[0], prints[1]), float(dynamics.at(configuration, rest).com[2]))
