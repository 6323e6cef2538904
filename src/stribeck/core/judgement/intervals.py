"""95 % intervals of parameters."""

import numpy as np
from scipy.special import stdtrit  # avoids the slow import of scipy.stats

from stribeck.core.base.typing import Array, BoolArray


def intervals_95(values: Array, deviation: Array, freedom: Array, logarithmic: BoolArray) -> Array:
    """Compute 95 % intervals, shape (p, 2).

    `deviation` is the standard error of each parameter, or of its logarithm where `logarithmic`.
    """
    half = stdtrit(freedom, 0.975) * deviation
    factor = np.exp(np.minimum(half, 100.0))
    lower = np.where(logarithmic, values / factor, values - half)
    upper = np.where(logarithmic, values * factor, values + half)
    return np.column_stack([lower, upper])
