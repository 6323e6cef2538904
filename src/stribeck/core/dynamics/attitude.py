"""Base orientation whose fast changes come from the gyroscope, where that is less noisy (complementary filter).

Angular accelerations are second derivatives of an orientation, but first derivatives of a gyroscope's rates.
"""

from dataclasses import replace

import numpy as np
import scipy  # its ndimage is slow to import: loaded at its first use

from stribeck.core.base.typing import Array
from stribeck.core.dynamics.state import continuous
from stribeck.core.log import RobotLog


def with_gyroscope(log: RobotLog, segments: tuple[slice, ...], period: float) -> tuple[RobotLog, list[str]]:
    """Combine orientation and gyroscope where they agree within the orientation's noise, and write a note.

    With the quaternion q and its change p' = q (w / 2) by the angular velocity w, in the frame of the IMU,

        q := p + smooth(q - p)

    where two running means of 0.2 s smooth the slow drift. Both agree within 1.5 times the noise of q.
    """
    half = round(0.1 / period)
    parts = [part for part in segments if part.stop - part.start > 2 * half]
    if log.base_orientation is None or log.angular_velocity is None or half < 2 or not parts:
        return log, []
    orientation, before, after, apart = log.base_orientation.copy(), [], [], []
    for part in parts:
        quaternions = continuous(log.base_orientation[part])
        rate = _change(quaternions, log.angular_velocity[part])
        turned = np.cumsum(period * (rate + np.roll(rate, 1, axis=0)) / 2, axis=0)
        drift = quaternions - turned
        for _ in range(2):  # a single pass lets noise of high frequencies through
            drift = _running_mean(drift, half)
        orientation[part] = turned + drift
        before.append(_white(quaternions))
        after.append(_white(orientation[part]))
        apart.append(np.std(orientation[part] - quaternions, axis=0))
    noise, noise_after, differ = (
        2 * float(np.sqrt(np.sum(np.square(deviations)) / 3 / len(parts))) for deviations in (before, after, apart)
    )
    if differ > 1.5 * noise or noise_after > 0.5 * noise:  # else the measured one is as good
        return log, []
    note = f"base_orientation has {noise:.1g} rad of noise; the gyroscope replaces its fast changes."
    return replace(log, base_orientation=orientation), [note]


def _running_mean(signal: Array, half: int) -> Array:
    """Compute means over `half` rows on either side, shape (T, n); at the ends, lines through the outermost windows."""
    size, place = 2 * half + 1, np.arange(-half, half + 1)[:, None]
    means = np.asarray(scipy.ndimage.uniform_filter1d(signal, size, axis=0))
    for window, end in ((slice(size), slice(half)), (slice(-size, None), slice(-half, None))):
        line = signal[window].mean(axis=0) + place * (place.T @ signal[window]) / np.sum(place**2)
        means[end] = line[end]
    return means


def _change(quaternions: Array, rate: Array) -> Array:
    """Compute the derivative of quaternions xyzw, shape (T, 4), from angular velocities in the moving frame, (T, 3)."""
    vector, scalar = quaternions[:, :3], quaternions[:, 3:]
    return np.hstack([scalar * rate + np.cross(vector, rate), -np.sum(vector * rate, axis=1, keepdims=True)]) / 2


def _white(signal: Array) -> Array:
    """Measure the standard deviation of white noise by third differences, shape (4,)."""
    return np.asarray(1.4826 * np.median(np.abs(np.diff(signal, 3, axis=0)), axis=0) / np.sqrt(20))
