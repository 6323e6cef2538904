"""The base's orientation from the gyroscope, the feet that stand flat on the ground, and the IMU's own attitude."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, hypot, pi

import numpy as np
import pinocchio as pin

from stribeck.log import Array

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
        Of the feet at the start [rad], shape (feet,).
    period
        [s]
    gains
        How much each measurement counts.
    """

    def __init__(self, rotation: Array, headings: Array, period: float, gains: AttitudeGains | None = None) -> None:
        self.rotation, self.headings, self.period = rotation, headings, period
        self.gains = gains or AttitudeGains()

    def update(self, orientation: Array, spin: Array, feet: Array, load: Array) -> Array:
        """Return the rotation from the base to the world after one more period, shape (3, 3).

        Parameters
        ----------
        orientation, spin
            What the IMU gives: quaternion xyzw, and angular velocity in the base [rad/s].
        feet
            Rotations from each sole to the base, shape (feet, 3, 3).
        load
            How far each foot stands, 0 to 1, shape (feet,).
        """
        gains, h = self.gains, self.period
        rotation = self.rotation @ pin.exp3(h * spin)
        measured = pin.Quaternion(orientation).toRotationMatrix()
        turn = h * gains.imu * pin.log3(measured @ rotation.T)
        soles = rotation @ feet
        share = h * gains.foot / max(float(load.sum()), 1.0)
        for k, (sole, bears) in enumerate(zip(soles, load.tolist(), strict=True)):
            heading = atan2(sole[1, 0], sole[0, 0])
            if bears > 0.0:
                flat = max(0.0, 1.0 - hypot(sole[0, 2], sole[1, 2]) / FLAT)
                off = (self.headings[k] - heading + pi) % (2 * pi) - pi
                turn += share * bears * flat * np.array([sole[1, 2], -sole[0, 2], off])
            if bears < 1.0:
                self.headings[k] = heading
        self.rotation = np.asarray(pin.exp3(turn) @ rotation)
        return self.rotation
