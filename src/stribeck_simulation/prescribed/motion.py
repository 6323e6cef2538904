"""The prescribed motion of a simulated robot: arms move freely, standing feet stay, swinging limbs swing."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from stribeck.robot import Robot
from stribeck.typing import Array
from stribeck_simulation.prescribed.base_sway import BaseSway, random_sway
from stribeck_simulation.prescribed.gait import Swing, swing_window
from stribeck_simulation.prescribed.limb import BodyMotion
from stribeck_simulation.prescribed.planted import planted_motion
from stribeck_simulation.prescribed.posture import Leg, default_posture, stand
from stribeck_simulation.prescribed.trajectory import Sines, Trajectory, random_sines

FREQUENCIES = (0.2, 2.0)
"""Of free joints [Hz]."""
PRISMATIC_SPEED = 0.7
"""The same of a prismatic joint [m/s]."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A prescribed motion of a robot, at any time.

    Attributes
    ----------
    free
        All joints' own motion; legs have their share added to the planted motion while they swing.
    posture
        Shape (n,).
    sway, legs, swings
        Of a floating robot.
    """

    robot: Robot
    free: Sines
    posture: Array
    sway: BaseSway | None = None
    legs: tuple[Leg, ...] = ()
    swings: tuple[Swing, ...] = ()

    def joints_at(self, time: Array, base: BodyMotion | None) -> Trajectory:
        """Return the joints' motion at these times [s], for this motion of the base, shape (T, n)."""
        joints = self.free.at(time)
        if base is None:
            return joints
        for leg in self.legs:
            columns = leg.limb.columns
            planted = planted_motion(leg.limb, leg.contact, base, leg.rotation, leg.place, self.posture[columns])
            swinging = joints.columns(columns) * swing_window(self.swings, leg.contact.name, time)
            moved = planted + swinging
            joints.position[:, columns] = moved.position
            joints.velocity[:, columns] = moved.velocity
            joints.acceleration[:, columns] = moved.acceleration
        return joints


def random_motion(
    robot: Robot, posture: Mapping[str, float], swings: tuple[Swing, ...], generator: np.random.Generator
) -> Motion:
    """Draw a smooth random motion; see `Motion`.

    Raises
    ------
    SettingsError
        If the posture is unknown to the robot, or its feet cannot stand.
    """
    centre = default_posture(robot, posture)
    # bound of a revolute joint's speed [rad/s]; what it reaches is about 0.7 of it
    speed = np.where(robot.prismatic, PRISMATIC_SPEED, 2.8)
    if robot.base == "fixed":
        return Motion(robot, random_sines(centre, _room(robot, centre), speed, FREQUENCIES, generator), centre)
    centre, height, legs = stand(robot, centre)
    free = random_sines(centre.copy(), _room(robot, centre), speed, FREQUENCIES, generator)
    # of swinging limbs, which have less time [Hz]
    # largest distance of a swinging limb's joints from those of the planted limb [rad]
    swing = random_sines(np.zeros(len(centre)), np.full(len(centre), 0.4), speed, (0.6, 2.0), generator)
    for leg in legs:
        for signal, replacement in ((free.amplitude, swing.amplitude), (free.pulsation, swing.pulsation)):
            signal[:, leg.limb.columns] = replacement[:, leg.limb.columns]
        free.centre[leg.limb.columns] = 0.0
    return Motion(robot, free, centre, random_sway(height, generator), tuple(legs), swings)


def _room(robot: Robot, centre: Array) -> Array:
    """Return how far joints may go from the centre [rad] or [m], shape (n,)."""
    low, high = robot.position_limits
    # share of the way from the posture to the nearer limit that a joint may go
    room = 0.9 * np.minimum(high - centre, centre - low)
    return np.asarray(np.where(np.isfinite(room), np.maximum(room, 0.0), 2 * np.pi))
