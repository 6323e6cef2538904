"""State estimation from encoders, IMU and foot forces."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, hypot, pi
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array
from stribeck.simulation.walking.balance.terms import Dynamics

FLAT = 0.06
"""Apparent tilt [rad] above which a foot tips and does not correct the tilt of the base."""


@dataclass(frozen=True, kw_only=True)
class AttitudeGains:
    """Correction rates of the attitude estimate [1/s]."""

    imu: float = 0.1
    foot: float = 3.0


class AttitudeFilter:
    """Integrate the gyroscope, with strong corrections by standing feet and weak corrections by the IMU's attitude.

    During motion, the attitude of an IMU has errors of one or two degrees that vary within seconds. The encoders
    between the base and a foot on flat ground are ten times more accurate. Only the IMU measures the heading of the
    first foot.

    Parameters
    ----------
    rotation
        Initial rotation from the base to the world, shape (3, 3).
    headings
        Initial headings of the feet [rad].
    period
        Sampling period [s].
    """

    def __init__(self, rotation: Array, headings: Sequence[float], period: float) -> None:
        self.rotation, self.headings, self.period = rotation, list(headings), period
        self.gains = AttitudeGains()

    def turn(self, spin: Array) -> Array:
        """Integrate the gyroscope over one period; return the rotation from the base to the world, shape (3, 3).

        Parameters
        ----------
        spin
            Angular velocity in base coordinates [rad/s].
        """
        self.rotation = self.rotation @ pin.exp3(self.period * spin)
        return self.rotation

    def correct(self, orientation: Array, soles: Sequence[Array], load: Sequence[float]) -> Array:
        """Correct the estimate, and return it.

        Parameters
        ----------
        orientation
            Quaternion xyzw from the IMU.
        soles
            Rotations from each sole to the world according to the current estimate, shape (feet, 3, 3).
        load
            Weight of each foot, 0 in the air to 1 in stance, shape (feet,).
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


class Measurement(NamedTuple):
    """Sensor values at one instant; joints in the tree's order.

    Attributes
    ----------
    position
        Joint positions, shape (n,) [rad].
    orientation, angular_velocity, specific_force
        Base orientation as quaternion xyzw; angular velocity [rad/s] and specific force [m/s^2] in base coordinates.
    foot_force
        Vertical force on each foot [N], shape (feet,).
    """

    position: Array
    orientation: Array
    angular_velocity: Array
    specific_force: Array
    foot_force: Array


@dataclass(frozen=True, kw_only=True)
class EstimatorGains:
    """Correction gains per period [1]."""

    joint_position: float = 0.75
    joint_velocity: float = 0.37
    base_position: float = 0.1
    base_velocity: float = 0.1
    foothold: float = 0.36  # for the foothold of an unloaded foot
    ground: float = 0.004  # for a foothold's height towards the flat ground


class StateEstimator:
    """Estimate joints by an alpha-beta filter, and the base by strapdown integration corrected by standing feet.

    A standing foot has a foothold p in the world. With the foot's position r in the base, and the base's orientation R
    and angular velocity w, the base is at `p - R r` and its velocity is `-R (w x r + r')`. The correction is weighted
    by the load on the foot. The foothold of an unloaded foot follows the foot; all footholds slowly follow the ground's
    height.
    """

    def __init__(self, dynamics: Dynamics, configuration: Array, period: float) -> None:
        self.dynamics, self.period, self.gains = dynamics, period, EstimatorGains()
        self.configuration = configuration.copy()
        self.velocity = np.zeros(dynamics.model.nv)
        self._data = dynamics.model.createData()
        self._turning = np.concatenate([np.zeros(3), configuration[3:]])
        self._rates = np.zeros(dynamics.model.nv)
        self._base_velocity = np.zeros(3)
        soles, arms, _ = self._feet()
        rotation = pin.Quaternion(configuration[3:7]).toRotationMatrix()
        self._attitude = AttitudeFilter(rotation, [atan2(sole[1, 0], sole[0, 0]) for sole in soles], period)
        self._footholds = configuration[:3] + arms

    def update(self, measured: Measurement) -> tuple[Array, Array]:
        """Compute Pinocchio's configuration and velocity after one more period."""
        gains, h = self.gains, self.period
        joints, rates = self._follow_joints(measured.position)
        self._turning[3:7] = pin.Quaternion(self._attitude.turn(measured.angular_velocity)).coeffs()
        self._turning[7:], self._rates[3:6], self._rates[6:] = joints, measured.angular_velocity, rates
        soles, arms, swings = self._feet()
        # relative load below which a foot has no weight, and above which it has full weight
        low, high = (share * self.dynamics.weight for share in (0.05, 0.35))
        load = [min(max((force - low) / (high - low), 0.0), 1.0) for force in measured.foot_force.tolist()]
        rotation = self._attitude.correct(measured.orientation, soles, load)

        force = rotation @ measured.specific_force + self.dynamics.gravity
        position = self.configuration[:3] + h * self._base_velocity + h * h / 2 * force
        velocity = self._base_velocity + h * force
        bearing = sum(load)
        trust, share = np.array(load) / max(bearing, 1.0), min(bearing, 1.0)
        position += gains.base_position * (trust @ (self._footholds - arms) - share * position)
        velocity -= gains.base_velocity * (trust @ swings + share * velocity)
        for k, bears in enumerate(load):
            if bears < 1.0:
                self._footholds[k] += gains.foothold * (1 - bears) * (position + arms[k] - self._footholds[k])
        self._footholds[:, 2] *= 1 - gains.ground

        self.configuration = np.concatenate([position, pin.Quaternion(rotation).coeffs(), joints])
        self._base_velocity = velocity
        self.velocity = np.concatenate([velocity @ rotation, measured.angular_velocity, rates])
        return self.configuration, self.velocity

    def _follow_joints(self, measured: Array) -> tuple[Array, Array]:
        gains, h = self.gains, self.period
        expected = self.configuration[7:] + h * self.velocity[6:]
        error = measured - expected
        return expected + gains.joint_position * error, self.velocity[6:] + gains.joint_velocity / h * error

    def _feet(self) -> tuple[list[Array], Array, Array]:
        """Compute rotations, positions and velocities of the soles for a base that rotates at the world's origin."""
        model, data = self.dynamics.model, self._data
        pin.forwardKinematics(model, data, self._turning, self._rates)
        soles, (arms, swings) = [], np.empty((2, len(self.dynamics.frames), 3))
        for k, frame in enumerate(self.dynamics.frames):
            pose = pin.updateFramePlacement(model, data, frame)
            soles.append(pose.rotation)
            arms[k] = pose.translation
            swings[k] = pin.getFrameVelocity(model, data, frame, pin.LOCAL_WORLD_ALIGNED).linear
        return soles, arms, swings
