"""The smooth window that both sides of the equation of motion pass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stribeck.log import Array

BOXES = 4
"""Boxes that are convolved: a window with three continuous derivatives, whose spectrum falls with the fourth power."""

LENGTH = 0.041
"""Of the whole window [s]: long enough to average encoder noise away, short against the motion."""

SPACING = 0.010
"""Of the windows [s]: a quarter of their length loses nothing."""


@dataclass(frozen=True, eq=False)
class Window:
    """Weights of a window, shape (L,), summing to one, and rows from one window to the next."""

    taps: Array
    step: int

    def count(self, rows: int) -> int:
        """Return how many windows lie inside a stretch of rows."""
        return max(0, (rows - len(self.taps)) // self.step + 1)

    def rows(self, count: int) -> int:
        """Return how many rows so many windows take."""
        return len(self.taps) + (count - 1) * self.step

    def apply(self, signal: Array) -> Array:
        """Return the windows of a signal, shape (T, n) -> (K, n)."""
        if not self.count(len(signal)):
            return np.empty((0, signal.shape[1]))
        views = np.lib.stride_tricks.sliding_window_view(signal, len(self.taps), axis=0)[:: self.step]
        return np.asarray(views @ self.taps)

    def lags(self, length: int) -> int:
        """Return how many windows apart errors are still correlated, that a filter of a length makes of white noise."""
        return max(1, (len(self.taps) + length - 2) // self.step)

    def overlap(self, kernel: Array, lags: int) -> Array:
        """Return the correlation of these errors [1 / variance of the noise] at lags 0 to `lags`, shape (lags + 1,)."""
        response = np.convolve(self.taps, kernel)
        full = np.correlate(response, response, mode="full")[len(response) - 1 :: self.step]
        overlap = np.zeros(lags + 1)
        overlap[: min(len(full), lags + 1)] = full[: lags + 1]
        return overlap


def smooth_window(period: float) -> Window:
    """Return the window for a sampling period [s]; a single sample where samples are further apart than it is long."""
    box = np.ones(max(1, round((LENGTH / period + BOXES - 1) / BOXES)))
    taps = np.ones(1)
    for _ in range(BOXES):
        taps = np.convolve(taps, box / len(box))
    return Window(taps, max(1, round(SPACING / period)))
