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

LAGS = 5
"""Windows further apart than this have independent errors [1]."""


@dataclass(frozen=True, eq=False)
class Window:
    """Weights of a window, shape (L,), summing to one, and rows from one window to the next."""

    taps: Array
    step: int

    def count(self, rows: int) -> int:
        """Return how many windows lie inside a stretch of rows."""
        return max(0, (rows - len(self.taps)) // self.step + 1)

    def apply(self, signal: Array) -> Array:
        """Return the windows of a signal, shape (T, n) -> (K, n)."""
        if not self.count(len(signal)):
            return np.empty((0, signal.shape[1]))
        views = np.lib.stride_tricks.sliding_window_view(signal, len(self.taps), axis=0)[:: self.step]
        return np.asarray(views @ self.taps)

    def overlap(self, kernel: Array) -> Array:
        """Return how errors of windows are correlated that a filter `kernel` makes of white noise, shape (LAGS + 1,)."""
        response = np.convolve(self.taps, kernel)
        full = np.correlate(response, response, mode="full")[len(response) - 1 :: self.step]
        overlap = np.zeros(LAGS + 1)
        overlap[: min(len(full), LAGS + 1)] = full[: LAGS + 1]
        return overlap


def smooth_window(period: float) -> Window:
    """Return the window for a sampling period [s]; a single sample where samples are further apart than it is long."""
    box = np.ones(max(1, round((LENGTH / period + BOXES - 1) / BOXES)))
    taps = np.ones(1)
    for _ in range(BOXES):
        taps = np.convolve(taps, box / len(box))
    return Window(taps, max(1, round(SPACING / period)))
