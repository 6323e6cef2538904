"""A switch with two thresholds, for many signals at once."""

import numpy as np
from numpy.typing import NDArray

from stribeck.typing import Array


def switch(signal: Array, on: float, off: float) -> NDArray[np.bool_]:
    """Return whether a signal is on: it goes on above `on`, off below `off`, and in between stays as it was.

    Parameters
    ----------
    signal
        Shape (T, k); each column is a switch of its own. A first value in between counts for the nearer threshold.
    on, off
        `off` is not above `on`.
    """
    decided = (signal > on) | (signal < off)
    decided[:1] = True
    latest = np.maximum.accumulate(np.where(decided, np.arange(len(signal))[:, None], 0), axis=0)
    return np.asarray(np.take_along_axis(signal, latest, axis=0) > (on + off) / 2)
