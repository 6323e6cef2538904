"""The smooth window that both sides of the equation of motion pass (docs/estimator.md, equations 2 and 7)."""

from dataclasses import dataclass

import numpy as np

from stribeck.base.typing import Array
from stribeck.whole_log.equations.constants import BOXES, NEGLIGIBLE_CORRELATION, WINDOW_LENGTH, WINDOW_SPACING
from stribeck.whole_log.weak_equations import through_windows


@dataclass(frozen=True, eq=False)
class Window:
    """Weights of a window, shape (L,), summing to one, and rows from one window to the next."""

    taps: Array
    step: int

    def count(self, rows: int) -> int:
        """Return how many windows lie inside a segment of rows."""
        return max(0, (rows - len(self.taps)) // self.step + 1)

    def rows(self, count: int) -> int:
        """Return how many rows so many windows take."""
        return len(self.taps) + (count - 1) * self.step

    def apply(self, signal: Array) -> Array:
        """Return the windows of a signal, shape (T, n) -> (K, n)."""
        if not self.count(len(signal)):
            return np.empty((0, signal.shape[1]))
        return through_windows(signal, self.taps, self.step)

    def overlaps(self, *kernels: Array) -> list[Array]:
        """Return the autocovariance of windows of white noise of unit variance, of each filter: equation (7).

        From lag 0 to the last that is not negligible for any filter, and one at least, shape (lags + 1,).
        """
        responses = [np.convolve(self.taps, kernel) for kernel in kernels]
        longest = max(len(response) for response in responses)
        found = np.zeros((len(kernels), longest // self.step + 2))
        for own, response in zip(found, responses, strict=True):
            full = np.correlate(response, response, mode="full")[len(response) - 1 :: self.step]
            own[: len(full)] = full
        reached = np.abs(found) > NEGLIGIBLE_CORRELATION * found[:, :1]
        lags = max(1, int(np.flatnonzero(reached.any(axis=0))[-1]))
        return list(found[:, : lags + 1])


def smooth_window(period: float) -> Window:
    """Return the window for a sampling period [s]; a single sample where samples are further apart than it is long."""
    box = np.ones(max(1, round((WINDOW_LENGTH / period + BOXES - 1) / BOXES)))
    taps = np.ones(1)
    for _ in range(BOXES):
        taps = np.convolve(taps, box / len(box))
    return Window(taps, max(1, round(WINDOW_SPACING / period)))
