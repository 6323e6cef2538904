"""Sensor noise of a log from sixth differences, and single samples that are wrong (docs/estimator.md, equation 1).

Differences: Gasser, Sroka and Jennen-Steinmetz 1986; median: Rousseeuw and Croux 1993; step of an encoder: Bennett
1948; outlier identifier: Hampel 1974, with predictions in place of the local median, because robots move.
"""

from dataclasses import dataclass
from math import comb

import numpy as np

from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.log.storage import allocate

SPIKE = 5.0
"""Distance of a spike from all predictions [1], in standard deviations: white noise reaches it once in 10 million."""

PREDICTIONS = np.array([[-3, 0, 3, 6, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 6, 3, 0, -3], [0, 0, -1, 4, 0, 4, -1, 0, 0]]) / 6
"""Weights of nine samples [1] in predictions of the fifth: by lines through four neighbors, by a cubic through all."""


@dataclass(frozen=True, eq=False)
class NoiseLevels:
    """Standard deviations of white noise of positions [rad] and torques [N m], shape (n,), and wrenches, (feet, 6)."""

    position: Array
    torque: Array
    wrench: Array


SMALLEST = NoiseLevels(np.array([1e-7]), np.array([1e-3]), np.repeat([0.5, 0.05], 3))
"""Smallest noise of encoders [rad], torque sensors [N m] and wrench sensors [N], [N m].

Rounding and clocks always leave some encoder noise, and a smaller value would hide slow errors. Feet in the air measure
no wrench.
"""


def measure_noise(
    position: Array, torque: Array, unbroken: tuple[slice, ...], wrench: Array | None = None
) -> NoiseLevels:
    """Measure the noise of positions and torques, shape (T, n), and wrenches, (T, feet, 6), by sixth differences.

    Impacts do not move their median absolute value. A coarse encoder that often repeats a reading has a median of zero:
    its step divided by sqrt(12) is a lower bound.
    """
    wrench = np.zeros((len(position), 0, 6)) if wrench is None else wrench
    of_wrench = white_noise(wrench.reshape(len(wrench), -1), unbroken).reshape(wrench.shape[1:])
    return NoiseLevels(
        np.maximum(white_noise(position, unbroken), SMALLEST.position),
        np.maximum(white_noise(torque, unbroken), SMALLEST.torque),
        np.maximum(of_wrench, SMALLEST.wrench),
    )


def leading_rows(signal: Array, unbroken: tuple[slice, ...]) -> list[Array]:
    """Return the first rows of a signal's unbroken parts, shape (T, n) -> (t, n) each, 60,000 in all to save time."""
    budget, parts = 60_000, []
    for part in unbroken:
        parts.append(signal[part.start : min(part.stop, part.start + budget)])
        budget -= len(parts[-1])
    return parts


def white_noise(signal: Array, unbroken: tuple[slice, ...]) -> Array:
    """Compute the standard deviation of the noise of each channel, equation (1), shape (n,)."""
    order = 6  # smooth motion hardly shows in these differences, noise thirtyfold
    parts = [part for part in leading_rows(signal, unbroken) if len(part) > order]
    if not parts:
        return np.zeros(signal.shape[1])
    differences = np.concatenate([np.diff(part, order, axis=0) for part in parts])
    gain = float(np.sqrt(sum(comb(order, k) ** 2 for k in range(order + 1))))
    return np.asarray(np.maximum(_median_deviation(differences, 0) / gain, _resolution(parts) / np.sqrt(12)))


def _median_deviation(values: Array, axis: int) -> Array:
    """Compute the standard deviation of normally distributed values around zero from their median absolute value."""
    return np.asarray(1.4826 * np.median(np.abs(values), axis=axis))


def _resolution(parts: list[Array]) -> Array:
    """Find the step of each channel's readings, 0 for channels that rarely repeat a reading, shape (n,)."""
    changes = np.abs(np.concatenate([np.diff(part, axis=0) for part in parts]))
    steps = np.zeros(changes.shape[1])
    for k, column in enumerate(changes.T):
        moved = column[column > 0]
        if 0 < len(moved) < 0.9 * len(column):
            steps[k] = np.percentile(moved, 1)
    return steps


def without_spikes(
    signal: Array, unbroken: tuple[slice, ...], floor: Array | float, *, smooth: bool
) -> tuple[Array, int]:
    """Replace the spikes of a signal, shape (T, n), by the cubic through their neighbors, and count them.

    A spike is further than `SPIKE` standard deviations from each of three predictions: the lines through the samples
    before and through the samples after, and the cubic between both. Steps agree with one of the lines, and smooth
    motion with the cubic.

    Parameters
    ----------
    unbroken
        Rows between which no prediction may reach.
    floor
        Smallest noise of a channel, shape (1,) or (n,).
    smooth
        Whether the signal has no kinks. Torques have kinks where friction reverses: their spikes must also be as far
        outside the range of the four samples around them.
    """
    noise, inside = np.maximum(white_noise(signal, unbroken), floor), np.zeros(len(signal), dtype=bool)
    for part in unbroken:
        inside[part.start + 4 : max(part.stop - 4, part.start)] = True  # samples that predictions need
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


def _spikes(column: Array, inside: BoolArray, noise: float, smooth: bool) -> IntArray:
    """Find the rows of a channel's spikes, given the standard deviation of its noise."""
    if len(column) < PREDICTIONS.shape[1]:
        return np.zeros(0, dtype=np.int64)
    off = np.full(len(column), np.inf)
    for weights in PREDICTIONS:
        error = column - np.correlate(column, weights, mode="same")
        np.minimum(off, np.abs(error) / np.sqrt(1 + weights @ weights), out=off)
    rows = np.flatnonzero(inside & (off > SPIKE * noise))
    if not smooth:
        around = column[rows[:, None] + np.array([-2, -1, 1, 2])]
        outside = np.maximum(column[rows] - around.max(axis=1), around.min(axis=1) - column[rows])
        rows = rows[outside > SPIKE * noise]
    near = np.clip(rows[:, None] + np.arange(-20, 21), 4, len(off) - 5)  # impacts have neighbors as far off: no spikes
    return rows[off[rows] > SPIKE * _median_deviation(off[near], 1)] if len(rows) else rows


def _between(column: Array, rows: IntArray) -> Array:
    """Compute the cubic through the two nearest other samples on either side of rows."""
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
