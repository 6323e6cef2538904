"""Periodic motions as finite Fourier series, at rest where a period begins and ends (Swevers et al. 1997).

With w = 2 pi / P and the harmonics k,

    q(t) = c + sum_k a_k / (k w) sin(k w t) - b_k / (k w) cos(k w t),   sum_k a_k = 0,   sum_k k b_k = 0

Velocity and acceleration are zero at t = 0. Periods follow one another, and the last one ends at rest.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, null_space

from stribeck.dynamics.state import State
from stribeck.typing import Array

HARMONICS = np.array([1, 2, 3, 5, 8])
"""Harmonics of a period: a few that lie apart reach slow and fast motion with few coefficients."""

AT_REST = block_diag(null_space(np.ones((1, len(HARMONICS)))), null_space(HARMONICS[None].astype(float)))
"""Weights a_k and b_k by the free coefficients, shape (2 harmonics, FREE)."""

FREE = 2 * (len(HARMONICS) - 1)
"""Coefficients per joint that rest at the ends leaves free [1]."""


@dataclass(frozen=True, eq=False)
class Series:
    """Motion of m joints.

    Attributes
    ----------
    period
        [s]
    centre
        [rad], [m], shape (m,).
    coefficients
        Free ones [rad/s], [m/s], shape (FREE, m).
    """

    period: float
    centre: Array
    coefficients: Array

    def at(self, time: Array) -> State:
        """Compute the motion at some times [s], shape (T, m)."""
        k = 2 * np.pi * HARMONICS / self.period
        sine, cosine = np.sin(np.outer(time, k)), np.cos(np.outer(time, k))
        sides = np.hstack([sine / k, -cosine / k]), np.hstack([cosine, sine]), np.hstack([-sine * k, cosine * k])
        weights = AT_REST @ self.coefficients  # a_k and b_k of all joints
        position, velocity, acceleration = (side @ weights for side in sides)
        return State(self.centre + position, velocity, acceleration)
