"""A smooth random motion of the base: it sways a few centimetres and degrees about the place where it stands."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from stribeck.typing import Array
from stribeck_simulation.prescribed.limb import BodyMotion, Limb, end_motion
from stribeck_simulation.prescribed.trajectory import Sines, Trajectory, random_sines

FREQUENCIES = (0.2, 1.0)
"""Of the base's sway [Hz]."""

_GIMBAL = Limb(
    placements=[pin.SE3.Identity()] * 7,
    axes=np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1], [0, 1, 0], [1, 0, 0]]),
    prismatic=(True, True, True, False, False, False),
    columns=np.arange(6),
)
"""Three slides along the world's axes, then yaw, pitch and roll: the base as the end of a limb of the world."""


@dataclass(frozen=True, eq=False)
class BaseSway:
    """Position along x, y, z [m], then yaw, pitch and roll [rad], as six sums of sines."""

    sines: Sines

    def at(self, time: Array, shift: Trajectory | None = None) -> BodyMotion:
        """Return the base's motion at these times [s], moved by `shift` [m], shape (T, 3)."""
        pose = self.sines.at(time)
        if shift is not None:
            zero = np.zeros_like(shift.position)
            pose = pose + Trajectory(
                np.hstack([shift.position, zero]),
                np.hstack([shift.velocity, zero]),
                np.hstack([shift.acceleration, zero]),
            )
        samples = len(time)
        world = BodyMotion(
            np.broadcast_to(np.eye(3), (samples, 3, 3)), np.zeros((samples, 3)), *np.zeros((2, samples, 6))
        )
        return end_motion(_GIMBAL, world, pose.position, pose.velocity, pose.acceleration)[0]


def random_sway(height: float, generator: np.random.Generator) -> BaseSway:
    """Draw a sway of a base that stands `height` [m] above its feet, which are near z = 0."""
    centre = np.array([0, 0, height, 0, 0, 0])
    # largest sway of the base position along each axis, as a share of its height above the feet
    reach = np.repeat([0.03 * height, 0.06], 3)  # largest roll, pitch and yaw [rad]
    return BaseSway(random_sines(centre, reach, 2 * np.pi * FREQUENCIES[1] * reach, FREQUENCIES, generator))
