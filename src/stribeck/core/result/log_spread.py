"""Spread of friction between logs of one robot, learned from the logs at hand and a prior from public robots.

The logarithm of a joint's friction differs from log to log with a standard deviation sigma_j, which is similar in all
joints of a robot:

    log sigma_j = lambda + normal(0, w^2),    lambda = log m + normal(0, u^2),

with m, u and w from public robots (`PRIOR`). A difference of logs has the variance c sigma_j^2 + phi s^2, with s its
standard error. The share phi of s^2 differs from log to log; the rest, such as an error of the model, repeats. Few
differences are changes. sigma, lambda and phi are integrated on a grid (Gelman et al., Bayesian Data Analysis, 2013,
section 5.4).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy  # its parts are slow to import: loaded at its first use

from stribeck.core.base.typing import Array, IntArray

PRIOR = (0.045, 0.8, 0.3)
"""Median spread m between logs [1], its logarithmic standard deviation u between robots, and w between joints."""


@dataclass(frozen=True)
class LogSpread:
    """Probabilities of sigma on its grid, shape (C, 80), for C channels (joints, or their speeds), and mean phi (C,).

    In the methods, `count` is the number c of logs whose variance a difference contains: 2 for two logs, 1 + 1 / N for
    the next log and the mean of N logs.
    """

    weight: Array
    share: Array
    sigma: ClassVar[Array] = np.geomspace(3e-4, 1.0, 80)

    def tail(self, channel: int, difference: float, error: float, count: float) -> float:
        """Compute the probability of a larger difference of either sign, given an independent standard error [1]."""
        deviation = np.sqrt(count * self.sigma**2 + error**2 + np.finfo(float).tiny)
        return float(2 * self.weight[channel] @ scipy.special.ndtr(-abs(difference) / deviation))

    def quantile(self, channel: int, probability: float, error: float, count: float) -> float:
        """Compute the difference that is exceeded with a two-sided probability."""
        widest = np.hypot(max(count, 1.0) * self.sigma[-1], error)
        largest = 1e-300 - float(scipy.special.ndtri(probability / 2) * widest)
        goal = np.log(probability)
        return float(
            scipy.optimize.brentq(lambda x: np.log(self.tail(channel, x, error, count) + 1e-300) - goal, 0.0, largest)
        )

    def student(self) -> tuple[Array, Array]:
        """Approximate sigma by Student's distribution: scale [1] and degrees of freedom, shape (C,) each.

        The degrees of freedom nu match var(log sigma^2) = trigamma(nu / 2), approximately 1 / (nu / 2 - 1 / 2).
        """
        mean = self.weight @ np.log(self.sigma)
        variance = np.maximum(np.sum(self.weight * (np.log(self.sigma) - mean[:, None]) ** 2, axis=1), 1e-6)
        freedom = 1 / (2 * variance) + 1.0
        return np.sqrt(2 / freedom) * np.exp(mean + scipy.special.digamma(freedom / 2) / 2), freedom


def learn_spread(
    differences: Array, errors: Array, joint: IntArray, count: float = 2.0, *, others: bool = False
) -> LogSpread:
    """Learn the spread between logs from D differences of the logarithm of friction in C channels.

    Parameters
    ----------
    differences, errors
        Differences and their standard errors [1], shape (D, C); NaN where unknown.
    joint
        Number of the joint of each channel, shape (C,). The channels of one joint count as one.
    count
        Number of logs' variances in each difference.
    others
        Whether a channel's spread is learned only from other joints, as for the test of a change.
    """
    grid, (median, between_robots, between_joints) = np.log(LogSpread.sigma), PRIOR
    share = np.array([0.03, 0.3, 1.0])[:, None]  # grid of phi
    rare, size = 0.05, 0.5  # share of differences that are changes, and standard deviation of these
    likelihood = np.zeros((differences.shape[1], len(share), len(grid)))
    for channel, (difference, error) in enumerate(zip(differences.T, errors.T, strict=True)):
        valid = (np.abs(difference) < 1e3) & (error < 1e3)  # finite squares
        square, noise = difference[valid, None, None] ** 2, error[valid, None, None] ** 2
        variance = count * LogSpread.sigma**2 + share * noise
        wide = variance + size**2
        density = (1 - rare) * np.exp(-square / variance / 2) / np.sqrt(variance)
        density += rare * np.exp(-square / wide / 2) / np.sqrt(wide)
        likelihood[channel] = np.log(density + 1e-300).sum(axis=0)
    likelihood = _scaled(likelihood)
    similar = np.exp(-((grid[:, None] - grid) ** 2) / 2 / between_joints**2)  # density of log sigma_j, given lambda
    similar /= similar.sum(axis=1, keepdims=True)
    same = joint[:, None] == joint
    evidence = np.log(likelihood @ similar.T + 1e-300) / same.sum(axis=1)[:, None, None]
    prior = -((grid - np.log(median)) ** 2) / 2 / between_robots**2
    level = prior + evidence.sum(axis=0) - np.tensordot(same * 1.0, evidence, 1)  # given the other joints
    weight = _scaled(level) @ similar * (1.0 if others else likelihood)
    weight /= weight.sum(axis=(1, 2), keepdims=True)
    return LogSpread(weight=weight.sum(axis=1), share=weight.sum(axis=2) @ share[:, 0])


def smallest_text(changes: Mapping[str, float]) -> str:
    """Format the smallest changes [%] of the best and the worst joint, e.g. "4.1 % (elbow) to 12 % (wrist)"."""
    ends = dict.fromkeys((min(changes, key=changes.__getitem__), max(changes, key=changes.__getitem__)))
    return " to ".join(f"{change_text(changes[joint])} ({joint})" for joint in ends)


def change_text(change: float) -> str:
    """Format a positive change [%] with two digits, e.g. "4.1 %" or "over 1000 %"."""
    return f"{float(f'{change:.2g}'):g} %" if change <= 1000 else "over 1000 %"


def _scaled(logarithm: Array) -> Array:
    """Compute exponentials relative to the largest of each channel."""
    return np.asarray(np.exp(logarithm - logarithm.max(axis=(1, 2), keepdims=True, initial=-np.inf)))
