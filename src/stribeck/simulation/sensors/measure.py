"""Sensor models for a whole log, or sample by sample in a control loop.

Joint sensors are synchronous in every profile: torque and position of a sample have the same time.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from stribeck.core.base.typing import Array
from stribeck.core.log import RobotLog
from stribeck.simulation.sensors.profiles import SensorProfile

Samples = int | slice
"""Index of one sample, or a slice of samples."""
Reading = Callable[[Samples, Array], Array]


class Sensors:
    """Sensors of one run. Each method converts exact values of sample(s) k to sensor readings.

    All errors are drawn in advance. A controller that reads sample by sample and a log that is made afterwards
    therefore get the same errors.

    Parameters
    ----------
    profile
        Sensor profile.
    joints, feet
        Number of joints and feet.
    samples, period
        Number of samples, and sampling period [s].
    seed
        Seed of the errors.
    """

    def __init__(
        self, profile: SensorProfile, *, joints: int, feet: int, samples: int, period: float, seed: int
    ) -> None:
        self.profile, self.period = profile, period
        self.late = round(profile.delay / period)  # samples
        streams = np.random.SeedSequence(seed).spawn(6)
        encoder, torque, attitude, inertial, foot, clock = (np.random.default_rng(stream) for stream in streams)
        density = np.sqrt(0.5 / period)  # white noise of a density has this standard deviation when sampled
        wrench_noise = np.tile(np.repeat([profile.force_noise, profile.moment_noise], 3), feet)
        wrench_bias = np.tile(np.repeat([profile.force_bias, profile.moment_bias], 3), feet)

        self._position = _errors(encoder, samples, joints, profile.position_noise, profile.position_bias)
        self._torque = _errors(torque, samples, joints, profile.torque_noise, profile.torque_offset)
        rate = profile.torque_drift / 60 * torque.standard_normal(joints)
        self._torque += period * np.arange(samples)[:, None] * rate
        turn = _errors(attitude, samples, 3, 0.0, profile.orientation_bias)
        turn += _wandering(attitude, samples, period, profile.orientation_noise)
        self._turn = Rotation.from_rotvec(turn).as_quat()
        self._rate = _errors(inertial, samples, 3, profile.gyroscope_noise * density, profile.gyroscope_bias)
        self._force = _errors(inertial, samples, 3, profile.accelerometer_noise * density, profile.accelerometer_bias)
        self._wrench = _errors(foot, samples, 6 * feet, wrench_noise, wrench_bias).reshape(samples, feet, 6)
        largest = 0.45 * period  # limit of the jitter, for increasing time stamps
        self._clock = np.clip(profile.jitter * clock.standard_normal(samples), -largest, largest)

    def time(self, k: Samples, exact: Array) -> Array:
        """Measure time stamps [s]."""
        return exact + self._clock[k]

    def position(self, k: Samples, exact: Array) -> Array:
        """Measure joint positions [rad], shape (..., n)."""
        read = exact + self._position[k]
        step = self.profile.position_resolution
        return np.round(read / step) * step if step else read

    def torque(self, k: Samples, exact: Array) -> Array:
        """Measure joint torques [N m], shape (..., n)."""
        return exact + self._torque[k]

    def orientation(self, k: Samples, exact: Array) -> Array:
        """Measure quaternions xyzw, shape (..., 4): the exact rotation and an error about the IMU's axes."""
        turn = self._turn[k]
        (ax, ay, az, aw), (bx, by, bz, bw) = exact.T, turn.T
        product = [
            aw * bx + bw * ax + ay * bz - az * by,
            aw * by + bw * ay + az * bx - ax * bz,
            aw * bz + bw * az + ax * by - ay * bx,
            aw * bw - ax * bx - ay * by - az * bz,
        ]
        return np.array(product).T

    def angular_velocity(self, k: Samples, exact: Array) -> Array:
        """Measure the gyroscope's output [rad/s], shape (..., 3)."""
        return exact + self._rate[k]

    def linear_acceleration(self, k: Samples, exact: Array) -> Array:
        """Measure the accelerometer's output [m/s^2], shape (..., 3)."""
        return exact + self._force[k]

    def vertical_force(self, k: Samples, exact: Array) -> Array:
        """Measure the vertical forces at the feet [N], shape (..., feet)."""
        return exact + self._wrench[k][..., 2]

    def foot_wrench(self, k: Samples, exact: Array) -> Array:
        """Measure forces [N] and moments [N m] at the feet, shape (..., feet, 6)."""
        return exact + self._wrench[k]


def sensors_for(log: RobotLog, profile: SensorProfile, seed: int = 0) -> Sensors:
    """Create sensors for an exact, evenly sampled log."""
    samples = len(log.time)
    return Sensors(
        profile,
        joints=len(log.joint_names),
        feet=len(log.foot_names),
        samples=samples,
        period=float(log.time[-1] - log.time[0]) / max(samples - 1, 1),
        seed=seed,
    )


def measure(log: RobotLog, sensors: Sensors) -> RobotLog:
    """Measure an exact log: remove velocity and acceleration, and delay IMU and feet."""
    samples = len(log.time)
    rows = slice(0, samples)
    earlier = np.maximum(np.arange(samples) - sensors.late, 0)
    return replace(
        log,
        time=sensors.time(rows, log.time),
        position=sensors.position(rows, log.position),
        torque=sensors.torque(rows, log.torque),
        velocity=None,
        acceleration=None,
        base_orientation=_late(log.base_orientation, earlier, sensors.orientation),
        angular_velocity=_late(log.angular_velocity, earlier, sensors.angular_velocity),
        linear_acceleration=_late(log.linear_acceleration, earlier, sensors.linear_acceleration),
        contact=None if log.contact is None else log.contact[earlier],
        foot_wrench=_late(log.foot_wrench, earlier, sensors.foot_wrench),
    )


def with_noise(log: RobotLog, *, position: float | Array, torque: float | Array, seed: int = 0) -> RobotLog:
    """Add only white noise to a log, and remove velocity and acceleration.

    Parameters
    ----------
    log
        Exact log of any duration and rate.
    position, torque
        Standard deviation of white noise on positions [rad or m] and torques [N m or N], of all joints or shape (n,).
    seed
        Seed of the noise.
    """
    generator = np.random.default_rng(seed)
    return replace(
        log,
        position=log.position + position * generator.standard_normal(log.position.shape),
        torque=log.torque + torque * generator.standard_normal(log.torque.shape),
        velocity=None,
        acceleration=None,
    )


def _late(channel: Array | None, earlier: NDArray[np.int64], read: Reading) -> Array | None:
    return None if channel is None else read(slice(0, len(channel)), channel[earlier])


def _errors(
    generator: np.random.Generator, samples: int, channels: int, noise: float | Array, bias: float | Array
) -> Array:
    """Draw white noise and a constant bias, shape (T, channels)."""
    white = noise * generator.standard_normal((samples, channels))
    return np.asarray(white + bias * generator.standard_normal(channels))


def _wandering(generator: np.random.Generator, samples: int, period: float, deviation: float) -> Array:
    """Draw a first-order Gauss-Markov process of this standard deviation from the start, shape (T, 3)."""
    # correlation time of an orientation's error [s]: memory of a typical attitude filter
    memory = np.exp(-period / 5.0)
    drive = np.sqrt(1 - memory**2) * generator.standard_normal((samples, 3))
    drive[:1] = generator.standard_normal((min(samples, 1), 3))
    return np.asarray(deviation * lfilter([1.0], [1.0, -memory], drive, axis=0))
