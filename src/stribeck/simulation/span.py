"""Slices for consecutive indices."""

import numpy as np
from numpy.typing import NDArray


def span(index: NDArray[np.int64]) -> NDArray[np.int64] | slice:
    """Convert consecutive indices, shape (k,), to a slice, which is several times faster; keep all other indices."""
    follows = len(index) > 0 and bool(np.all(np.diff(index) == 1))
    return slice(int(index[0]), int(index[-1]) + 1) if follows else index
