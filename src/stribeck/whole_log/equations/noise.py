"""Sensor noise of a log from sixth differences (docs/estimator.md, equation 1).

Differences: Gasser, Sroka and Jennen-Steinmetz 1986; median: Rousseeuw and Croux 1993; step of an encoder: Bennett
1948.
"""

from dataclasses import dataclass
from math import comb

import numpy as np

from stribeck.base.typing import Array
from stribeck.whole_log.equations.constants import DIFFERENCES, MOST_ROWS, POSITION_FLOOR, TORQUE_FLOOR, WRENCH_FLOOR

MAD_TO_STANDARD_DEVIATION = 1.4826
"""Standard deviation over median absolute deviation of a normal distribution [1]."""


@dataclass(frozen=True, eq=False)
class NoiseLevels:
    """Standard deviations of white noise of positions [rad] and torques [N m], shape (n,), and wrenches, (feet, 6)."""

    position: Array
    torque: Array
    wrench: Array


def measure_noise(
    position: Array, torque: Array, unbroken: tuple[slice, ...], wrench: Array | None = None
) -> NoiseLevels:
    """Return the noise of positions and torques, shape (T, n), and wrenches, (T, feet, 6), by their sixth differences.

    Their median absolute value is not moved by impacts. A coarse encoder that often repeats a reading has a median of
    zero: its step over sqrt(12) is a lower bound.
    """
    if wrench is None:
        wrench = np.zeros((len(position), 0, 6))
    wrench_noise = white_noise(wrench.reshape(len(wrench), 6 * wrench.shape[1]), unbroken).reshape(wrench.shape[1:])
    return NoiseLevels(
        np.maximum(white_noise(position, unbroken), POSITION_FLOOR),
        np.maximum(white_noise(torque, unbroken), TORQUE_FLOOR),
        np.maximum(wrench_noise, WRENCH_FLOOR),
    )


def leading_rows(signal: Array, unbroken: tuple[slice, ...]) -> list[Array]:
    """Return the first rows of a signal's segments, shape (T, n) -> (t, n) each, `MOST_ROWS` together."""
    parts, rows_read = [], 0
    for segment in unbroken:
        rows = slice(segment.start, min(segment.stop, segment.start + MOST_ROWS - rows_read))
        rows_read += max(0, rows.stop - rows.start)
        parts.append(signal[rows.start : max(rows.start, rows.stop)])
    return parts


def white_noise(signal: Array, unbroken: tuple[slice, ...]) -> Array:
    """Return the standard deviation of each channel's noise, equation (1), shape (n,)."""
    parts = [part for part in leading_rows(signal, unbroken) if len(part) > DIFFERENCES]
    if not parts:
        return np.zeros(signal.shape[1])
    differences = np.abs(np.concatenate([np.diff(part, DIFFERENCES, axis=0) for part in parts]))
    gain = float(np.sqrt(sum(comb(DIFFERENCES, k) ** 2 for k in range(DIFFERENCES + 1))))
    white = MAD_TO_STANDARD_DEVIATION * np.median(differences, axis=0) / gain
    return np.asarray(np.maximum(white, _resolution(parts) / np.sqrt(12)))


def _resolution(parts: list[Array]) -> Array:
    """Return the step of each channel's readings, 0 where a reading is hardly ever repeated, shape (n,)."""
    changes = np.abs(np.concatenate([np.diff(part, axis=0) for part in parts]))
    steps = np.zeros(changes.shape[1])
    for k, column in enumerate(changes.T):
        moved = column[column > 0]
        if 0 < len(moved) < 0.9 * len(column):
            steps[k] = np.percentile(moved, 1)
    return steps
