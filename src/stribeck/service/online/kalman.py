"""Kalman filters of all joints at once, in Joseph's form, with the noise that the innovations show.

Each joint has a measurement per window, z = x^T s + e, and four states: scale minus one, offset and additional viscous
friction, all relative to the joint's friction at middle speed, and a payload relative to the robot's mass. The states
are random walks that slowly return to zero, so that their covariance is bounded over days of rest. Measurements beyond
`CLIP` standard deviations lose weight (Huber 1964); the noise is their mean square, times the factor by which their
correlation in time increases the variance of a mean of first-order autoregressive noise, (1 + r) / (1 - r).
"""

import numpy as np

from stribeck.core.base.typing import Array, BoolArray

STATES = 4
CLIP = 3.0
"""Innovation [standard deviations] beyond which a measurement loses weight."""
MEMORY = 600.0
"""Number of windows over which noise and correlation are averaged."""
CAUTIOUS, GUESSED = 40.0, 5.0
"""Number of first windows in which no innovation exceeds the noise, and weight of the guessed noise in windows."""


class JointFilters:
    """Kalman filters of n joints.

    Parameters
    ----------
    start, walk
        Standard deviation of the states at the start, and of their random walk in one second, shape (n, 4).
    returning
        Time constant with which the states return to zero [s].
    noise
        Variance of a measurement, shape (n,).

    Attributes
    ----------
    state, covariance
        States, shape (n, 4), and their covariances, shape (n, 4, 4).
    noise, lagged
        Mean square of the innovations in excess of the states' variance, and mean product of consecutive ones, for
        swinging and for standing limbs, shape (2, n).
    count
        Number of measurements of each kind, shape (2, n).
    """

    def __init__(self, start: Array, walk: Array, returning: float, noise: Array) -> None:
        joints = len(noise)
        self._walk, self._returning = walk**2, returning
        self._payload = float(start[0, 3]) ** 2
        self.state = np.zeros((joints, STATES))
        self.covariance = np.zeros((joints, STATES, STATES))
        self.covariance[:, range(STATES), range(STATES)] = start**2
        self.noise = np.tile(noise, (2, 1))
        self.lagged, self.last, self.count = np.zeros((3, 2, joints))

    def predict(self, seconds: float) -> None:
        """Let time pass."""
        kept = np.exp(-seconds / self._returning)
        self.state *= kept
        self.covariance *= kept**2
        grown = self._walk * self._returning / 2 * (1 - kept**2)
        self.covariance[:, range(STATES), range(STATES)] += grown

    def update(self, regressor: Array, value: Array, used: BoolArray, stands: BoolArray) -> None:
        """Add a measurement of the joints in `used`, shape (n,): regressors x, (n, 4), and values z, (n,).

        Joints in `stands`, shape (n,), have other noise, because errors of the model and of the tilt act on them.
        """
        P = self.covariance
        gain = (P @ regressor[:, :, None])[:, :, 0]
        variance = (regressor * gain).sum(axis=1)
        innovation = np.where(used, value - (regressor * self.state).sum(axis=1), 0.0)
        swinging, standing = self.noise * self.inflation()
        noise, early = np.where(stands, standing, swinging), np.where(stands, self.count[1], self.count[0]) < CAUTIOUS
        noise = np.maximum(noise, innovation**2 * early)  # the noise is not known yet
        size = np.abs(innovation) / np.sqrt(variance + noise)
        noise = noise * np.maximum(size / CLIP, 1.0) ** 2
        gain *= (used / (variance + noise))[:, None]
        self.state += gain * innovation[:, None]
        complement = np.eye(STATES) - gain[:, :, None] * regressor[:, None, :]
        P = complement @ P @ complement.transpose(0, 2, 1) + (gain * noise[:, None])[:, :, None] * gain[:, None, :]
        self.covariance = (P + P.transpose(0, 2, 1)) / 2
        self._learn_noise(np.sign(regressor[:, 0]) * innovation, variance, used & np.stack([~stands, stands]))

    def inflation(self) -> Array:
        """Compute the factor by which correlation in time increases the variance of a mean, shape (2, n)."""
        most = 0.95  # largest correlation of consecutive windows [1]
        correlation = np.clip(self.lagged / self.noise, 0.0, most)
        return np.asarray((1 + correlation) / (1 - correlation))

    def with_shared_payload(self) -> tuple[Array, Array, tuple[float, float]]:
        """Combine the joints' estimates of the payload, and give it to all of them.

        Robust mean, weighted by information beyond the prior; its error includes the scatter of the joints. Returns
        states (n, 4), covariances (n, 4, 4), and mass relative to the robot's with its standard error.
        """
        x, P = self.state, self.covariance
        information = np.maximum(1 / P[:, 3, 3] - 2 / (self._walk[:, 3] * self._returning), 0.0)
        estimate = np.divide(x[:, 3] / P[:, 3, 3], information, out=np.zeros(len(x)), where=information > 0)
        weight, mass, total = np.ones(len(x)), 0.0, 1 / self._payload
        for _ in range(3):
            total = 1 / self._payload + float(weight @ information)
            mass = float(weight @ (information * estimate)) / total
            size = np.abs(estimate - mass) * np.sqrt(information)
            weight = np.minimum(1.0, 2.0 / np.maximum(size, 1e-9))
        joints = int(np.sum(information * self._payload > 1))
        scatter = max(1.0, float(weight @ size**2) / max(joints - 1, 1))
        variance = scatter / total
        gain = P[:, :, 3] / P[:, 3, 3, None]
        state = x + gain * (mass - x[:, 3])[:, None]
        excess = np.maximum(P[:, 3, 3] - variance, 0.0)
        covariance = P - gain[:, :, None] * gain[:, None, :] * excess[:, None, None]
        return state, covariance, (mass, float(np.sqrt(variance)) if joints >= 2 else np.inf)

    def _learn_noise(self, error: Array, variance: Array, used: BoolArray) -> None:
        """Average the squares and products of innovations, signed by the direction of motion, for kinds in `used`."""
        self.count += used
        share = np.where(used, 1 / np.minimum(self.count + GUESSED, MEMORY), 0.0)
        limit = 3.0 * np.sqrt(self.noise + variance)  # three standard deviations of an innovation
        error = np.clip(error, -limit, limit)
        square = np.maximum(error**2 - variance, 0.01 * self.noise)
        self.noise += share * (square - self.noise)
        self.lagged += share * (error * self.last - self.lagged)
        self.last = np.where(used, error, self.last)
