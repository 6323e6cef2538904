"""Single samples that are wrong: found beside their neighbours, and replaced (docs/estimator.md, equation 2).

Outlier identifier: Hampel 1974; the local median is replaced by predictions, as signals of a robot move on.
"""

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.log.storage import allocate
from stribeck.whole_log.equations.constants import SPIKE, SPIKE_NEIGHBOURHOOD
from stribeck.whole_log.equations.noise import MAD_TO_STANDARD_DEVIATION, white_noise

LINE = np.array([1.0, 0.5, 0.0, -0.5])
"""Weights of the next four samples [1] in the value that the straight line through them has here."""

CUBIC = np.array([-1.0, 4.0, 4.0, -1.0]) / 6
"""Weights of the two samples before and the two after in the value that the cubic through them has here [1]."""

REACH = len(LINE)
"""Samples on either side that are needed [1]."""


def without_spikes(signal: Array, unbroken: tuple[slice, ...], floor: float, *, smooth: bool) -> tuple[Array, int]:
    """Return a signal, shape (T, n), whose spikes are replaced by the cubic through their neighbours, and their number.

    A spike is further from each of three predictions than `SPIKE` standard deviations: from the lines through the
    samples before and through those after, and from the cubic between both. Steps agree with one of the lines, and
    smooth motion with the cubic.

    Parameters
    ----------
    unbroken
        Rows that nothing may cross the ends of.
    floor
        Least noise of a channel.
    smooth
        Whether the signal has no kinks. Torques do, where friction reverses: a spike must then also be as far outside
        the range of the four samples around it.
    """
    noise, inside = np.maximum(white_noise(signal, unbroken), floor), np.zeros(len(signal), dtype=bool)
    for part in unbroken:
        inside[part.start + REACH : max(part.stop - REACH, part.start)] = True
    cleaned, count = signal, 0
    for k, deviation in enumerate(noise.tolist()):
        column = np.ascontiguousarray(signal[:, k])
        rows = _spikes(column, inside, deviation, smooth)
        if len(rows):
            if cleaned is signal:
                cleaned = allocate(signal.shape)
                cleaned[:] = signal
            cleaned[rows, k] = _between(column, rows)
            count += len(rows)
    return cleaned, count


def _spikes(column: Array, inside: NDArray[np.bool_], noise: float, smooth: bool) -> NDArray[np.int64]:
    """Return the rows of a channel's spikes, given the standard deviation of its noise."""
    if len(column) <= 2 * REACH:
        return np.zeros(0, dtype=np.int64)
    off = np.abs(column - _weighted(column, (-2, -1, 1, 2), CUBIC)) / np.sqrt(1 + CUBIC @ CUBIC)
    for side in (-1, 1):
        line = _weighted(column, tuple(side * step for step in range(1, REACH + 1)), LINE)
        np.minimum(off, np.abs(column - line) / np.sqrt(1 + LINE @ LINE), out=off)
    rows = np.flatnonzero(inside & (off > SPIKE * noise))
    if not smooth:
        around = column[rows[:, None] + np.array([-2, -1, 1, 2])]
        outside = np.maximum(column[rows] - around.max(axis=1), around.min(axis=1) - column[rows])
        rows = rows[outside > SPIKE * noise]
    near = np.clip(rows[:, None] + np.arange(-SPIKE_NEIGHBOURHOOD, SPIKE_NEIGHBOURHOOD + 1), 0, len(off) - 1)
    usual = MAD_TO_STANDARD_DEVIATION * np.median(off[near], axis=1) if len(rows) else np.zeros(0)
    return rows[off[rows] > SPIKE * usual]


def _weighted(column: Array, places: tuple[int, ...], weights: Array) -> Array:
    """Return the weighted sum of the samples at places relative to each row; of no use within `REACH` of the ends."""
    found = np.zeros(len(column))
    middle = found[REACH:-REACH]
    for place, weight in zip(places, weights.tolist(), strict=True):
        middle += weight * column[REACH + place : len(column) - REACH + place]
    return found


def _between(column: Array, rows: NDArray[np.int64]) -> Array:
    """Return the cubic through the two nearest other samples on either side of rows."""
    good = np.ones(len(column), dtype=bool)
    good[rows] = False
    others = np.flatnonzero(good)
    after = np.clip(np.searchsorted(others, rows), 2, len(others) - 2)
    nodes = others[after[:, None] + np.arange(-2, 2)]
    value = np.zeros(len(rows))
    for k in range(4):  # Lagrange
        rest = np.delete(nodes, k, axis=1)
        value += column[nodes[:, k]] * np.prod((rows[:, None] - rest) / (nodes[:, [k]] - rest), axis=1)
    return value
