"""The base's orientation from the gyroscope, the feet that stand flat on the ground, and the IMU's own attitude."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, hypot, pi

import numpy as np
import pinocchio as pin

from stribeck.typing import Array

FLAT = 0.06
"""A foot that seems tilted by this angle [rad] or more is tipping, and no measure of the base's tilt."""


@dataclass(frozen=True, kw_only=True)
class AttitudeGains:
    """How fast the estimate follows what it is held to [1/s]."""

    imu: float = 0.1
    foot: float = 3.0


class AttitudeFilter:
    """Integrates the gyroscope, held fast to the standing feet and loosely to the attitude that the IMU gives.

    The attitude of an IMU is good to a degree or two in motion and wanders within seconds; the chain of encoders down
    to a foot on flat ground is ten times better, and tells of heading how far the base has turned over the foot. The
    IMU alone knows which way the first foot has stood.

    Parameters
    ----------
    rotation
        From the base to the world at the start, shape (3, 3).
    headings
        Of the feet at the start [rad].
    period
        [s]
    gains
        How much each measurement counts.
    """

    def __init__(
        self, rotation: Array, headings: Sequence[float], period: float, gains: AttitudeGains | None = None
    ) -> None:
        self.rotation, self.headings, self.period = rotation, list(headings), period
        self.gains = gains or AttitudeGains()

    def turn(self, spin: Array) -> Array:
        """Turn by the gyroscope for one more period, and return the rotation from the base to the world, shape (3, 3).

        Parameters
        ----------
        spin
            Angular velocity in the base [rad/s].
        """
        self.rotation = self.rotation @ pin.exp3(self.period * spin)
        return self.rotation

    def correct(self, orientation: Array, soles: Sequence[Array], load: Sequence[float]) -> Array:
        """Hold the estimate to what was measured, and return it.

        Parameters
        ----------
        orientation
            Quaternion xyzw that the IMU gives.
        soles
            Rotations from each sole to the world under the present estimate, shape (feet, 3, 3).
        load
            How far each foot stands, 0 to 1, shape (feet,).
        """
        gains, h = self.gains, self.period
        x, y, z = (h * gains.imu * pin.log3(pin.Quaternion(orientation).toRotationMatrix() @ self.rotation.T)).tolist()
        share = h * gains.foot / max(sum(load), 1.0)
        for k, (sole, bears) in enumerate(zip(soles, load, strict=True)):
            (forward, _, tilt_x), (sideways, _, tilt_y), _ = sole.tolist()
            heading = atan2(sideways, forward)
            if bears > 0.0:
                counts = share * bears * max(0.0, 1.0 - hypot(tilt_x, tilt_y) / FLAT)
                x, y = x + counts * tilt_y, y - counts * tilt_x
                z += counts * ((self.headings[k] - heading + pi) % (2 * pi) - pi)
            if bears < 1.0:
                self.headings[k] = heading
        self.rotation = pin.exp3(np.array([x, y, z])) @ self.rotation
        return self.rotation
