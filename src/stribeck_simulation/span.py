"""Entries of an array that follow each other, as a slice."""

import numpy as np
from numpy.typing import NDArray


def span(index: NDArray[np.int64]) -> NDArray[np.int64] | slice:
    """Return a slice where entries follow each other, as it is several times as fast, else the index itself.

    Parameters
    ----------
    index
        Entries, shape (k,).
    """
    follows = len(index) > 0 and bool(np.all(np.diff(index) == 1))
    return slice(int(index[0]), int(index[-1]) + 1) if follows else index
