"""Autocorrelation beta of the model's errors, and its innovation weights (docs/estimator.md, equations 8 and 20)."""

from functools import cache

import numpy as np
from scipy.linalg import toeplitz

from stribeck.base.typing import Array

REACH_OF_FACTOR = 16
"""Times [1] the reach of the correlation after which the rows of its Cholesky factor no longer change."""

LEAST_POWER = 1e-6
"""White noise [1], relative to the errors, that keeps their factor apart from zero at every frequency."""


def autocorrelation(lags: int) -> Array:
    """Return the correlation of the model's errors at lags 0 to `lags` [1], (1 - j / (lags + 1))^2: equation (8).

    It is strictly convex, so that its spectrum is positive at every frequency (Polya 1949). A triangle's, that of a
    running mean, has zeros, and a fit would trust these frequencies more than any other.
    """
    return np.asarray((1 - np.arange(lags + 1) / (lags + 1)) ** 2)


def innovation_weights(overlap: Array) -> Array:
    """Return psi, shape (lags + 1,): what a unit innovation does to its own window and the next, from a correlation.

    Equation (20), beta(j) = sum_i psi_i psi_(i + j): the last row of the Cholesky factor of the Toeplitz matrix of beta
    (Bauer 1955).
    """
    return _innovation_weights(tuple(overlap.tolist()))


@cache
def _innovation_weights(overlap: tuple[float, ...]) -> Array:
    correlation = np.zeros(REACH_OF_FACTOR * len(overlap))
    correlation[: len(overlap)] = overlap
    correlation[0] *= 1 + LEAST_POWER  # accelerations have no error that does not change
    return np.asarray(np.linalg.cholesky(toeplitz(correlation))[-1, : -len(overlap) - 1 : -1])
