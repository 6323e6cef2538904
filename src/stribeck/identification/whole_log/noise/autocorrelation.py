"""How errors that no sensor makes fade from window to window."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.linalg import toeplitz

from stribeck.typing import Array

SETTLED = 16
"""Times [1] the reach of the correlation after which the rows of its Cholesky factor no longer change."""


LEAST_POWER = 1e-6
"""White noise [1], relative to the errors, that keeps their factor apart from zero at every frequency."""


def autocorrelation(lags: int) -> Array:
    """Return the correlation of these errors at lags 0 to `lags` [1], (1 - k / (lags + 1))^2.

    It is strictly convex, so that its spectrum is positive everywhere (Polya 1949). A running mean's, a triangle, has
    frequencies without any error at all. A fit would trust these more than anything: above all what changes as fast as
    friction does at a reversal, where no law of velocity is quite true.
    """
    return np.asarray((1 - np.arange(lags + 1) / (lags + 1)) ** 2)


def innovation_weights(overlap: Array) -> Array:
    """Return what a unit of white noise does to its own window and the next, shape (lags + 1,), from a correlation.

    The errors are sums of what all such drives do: this is the last row of their covariance's Cholesky factor (Bauer
    1955).
    """
    return _innovation_weights(tuple(overlap.tolist()))


@cache
def _innovation_weights(overlap: tuple[float, ...]) -> Array:
    correlation = np.zeros(SETTLED * len(overlap))
    correlation[: len(overlap)] = overlap
    correlation[0] *= 1 + LEAST_POWER  # accelerations have no error that does not change
    return np.asarray(np.linalg.cholesky(toeplitz(correlation))[-1, : -len(overlap) - 1 : -1])
