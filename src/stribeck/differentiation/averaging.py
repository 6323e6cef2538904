"""What a filter's acceleration is an average of, so that torque and friction law can be averaged alike.

A filtered acceleration is a weighted mean of second differences of the position,

    a_f[t] = sum_m w[m] (x[t+m+1] - 2 x[t+m] + x[t+m-1]) / dt^2

When a joint turns back, friction jumps within a few samples, the acceleration with it, and the filter smears the jump
over its window. A torque that goes through the same w is smeared alike, and what is left is the smeared friction,
`sum_m w[m] R(v[t+m])`. Compared with R(v[t]) it is a wrong law; compared with the law through the same w it is not.
"""

from dataclasses import dataclass

import numpy as np
import scipy  # its interpolate is slow to import: loaded at its first use

from stribeck.base.typing import Array

MOST_NODES = 31
"""Of a law's average; the weights of longer windows are shared out among as many."""


def implied_weights(acceleration_kernel: Array, period: float) -> Array:
    """Return w of `kernel = w * (1, -2, 1) / dt^2`, shape (L,), sum 1.

    The taps of a second derivative and their first moment sum to zero, so the double sum ends in zeros.
    """
    return np.roll(np.cumsum(np.cumsum(acceleration_kernel)) * period**2, 1)


@dataclass(frozen=True, eq=False)
class Nodes:
    """Instants around a sample, at which a law is evaluated for its average over the filter's window.

    Attributes
    ----------
    offsets
        [s], shape (K,); symmetric and ascending, or all in the past.
    weights
        Sum 1, shape (K,).
    reach
        Of the last one [samples].
    lag
        Of the velocity and the acceleration at a sample, which are averages as well [s]: 0 where the window is
        symmetric.
    """

    offsets: Array
    weights: Array
    reach: int
    lag: float = 0.0


def average_nodes(weights: Array, period: float) -> Nodes:
    """Return the nodes that stand for a filter's weights, shape (L,); a single one if nothing is averaged."""
    middle = len(weights) // 2
    reach = int(np.abs(np.flatnonzero(np.abs(weights) > 1e-9) - middle).max())
    taps = weights[middle - reach : middle + reach + 1]
    places = np.linspace(-reach, reach, min(len(taps), MOST_NODES))
    if len(taps) > MOST_NODES:
        # By interpolation between the nodes: the means of t, t^2 and t^3 stay what they are.
        taps = taps @ scipy.interpolate.CubicSpline(places, np.eye(MOST_NODES))(np.arange(-reach, reach + 1))
    return Nodes(period * places, np.asarray(taps / taps.sum(), dtype=np.float64), reach)


def exponential_nodes(decay: float, period: float) -> Nodes:
    """Return the nodes that stand for a first-order low-pass, which shrinks by `decay` a sample.

    Its weights on the past are exponential, cut here into equal shares, each with its own mean; the mean of all is the
    lag, `h / 2 + h d / (1 - d)` of samples that are means over periods themselves.
    """
    lag = period * (0.5 + decay / (1 - decay))
    ends = -np.log1p(-np.arange(MOST_NODES) / MOST_NODES)
    beyond = np.append((1 + ends) * np.exp(-ends), 0.0)  # integral of x e^-x from each end
    return Nodes(lag * MOST_NODES * np.diff(beyond), np.full(MOST_NODES, 1 / MOST_NODES), 0, lag)
