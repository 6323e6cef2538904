"""Weights of a filter's acceleration, for averaging the torque and the friction law in the same way.

A filtered acceleration is a weighted mean of second differences of the position,

    a_f[t] = sum_m w[m] (x[t+m+1] - 2 x[t+m] + x[t+m-1]) / dt^2

When a joint reverses, friction and acceleration jump within a few samples, and the filter smears the jump over its
window. A torque filtered with the same w is smeared alike, so the difference is the smeared friction,
`sum_m w[m] R(v[t+m])`. It must be compared with the law averaged with the same w, not with R(v[t]).
"""

from dataclasses import dataclass

import numpy as np
import scipy  # its interpolate is slow to import: loaded at its first use

from stribeck.core.base.typing import Array

MOST_NODES = 31
"""Largest number of nodes of a law's average; longer windows are interpolated to this number."""


def implied_weights(acceleration_kernel: Array, period: float) -> Array:
    """Compute w of `kernel = w * (1, -2, 1) / dt^2`, shape (L,), sum 1.

    The taps of a second derivative and their first moment sum to zero, so the double sum ends in zeros.
    """
    return np.roll(np.cumsum(np.cumsum(acceleration_kernel)) * period**2, 1)


@dataclass(frozen=True, eq=False)
class Nodes:
    """Instants around a sample at which a law is evaluated for its average over the filter's window.

    Attributes
    ----------
    offsets
        Time relative to the sample [s], shape (K,); symmetric and ascending, or all in the past.
    weights
        Weights with sum 1, shape (K,).
    reach
        Distance of the last node [samples].
    lag
        Delay of velocity and acceleration at a sample, which are averages too [s]; 0 if the window is symmetric.
    """

    offsets: Array
    weights: Array
    reach: int
    lag: float = 0.0


def average_nodes(weights: Array, period: float) -> Nodes:
    """Compute the nodes of a filter's weights, shape (L,); a single node if the filter does not average."""
    middle = len(weights) // 2
    reach = int(np.abs(np.flatnonzero(np.abs(weights) > 1e-9) - middle).max())
    taps = weights[middle - reach : middle + reach + 1]
    places = np.linspace(-reach, reach, min(len(taps), MOST_NODES))
    if len(taps) > MOST_NODES:
        # Cubic interpolation between the nodes preserves the means of t, t^2 and t^3.
        taps = taps @ scipy.interpolate.CubicSpline(places, np.eye(MOST_NODES))(np.arange(-reach, reach + 1))
    return Nodes(period * places, np.asarray(taps / taps.sum(), dtype=np.float64), reach)
