"""Interpolation between samples for each kind of signal, without extrapolation; and delays of signals."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import scipy  # its interpolate is slow to import: loaded at its first use
from numpy.typing import NDArray

from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.log import RobotLog
from stribeck.core.log.storage import BLOCK_ROWS, allocate


def linear(query: Array, time: Array, values: Array) -> Array:
    """Interpolate linearly at `query`, shape (Q, ...); `values` have shape (T, ...) at increasing `time`."""
    result = allocate((len(query), *values.shape[1:]))
    columns, wanted = values.reshape(len(time), -1), result.reshape(len(query), -1)
    for index in range(columns.shape[1]):
        wanted[:, index] = np.interp(query, time, columns[:, index])
    return result


def cubic(query: Array, time: Array, values: Array) -> Array:
    """Interpolate with a cubic spline at increasing `query`, shape (Q, n); `values` are (T, n) at increasing `time`.

    Long signals are processed in blocks, whose splines extend `margin` samples beyond the block.
    """
    margin = 64  # samples; the influence of a sample on a cubic spline falls to a quarter per sample
    result = allocate((len(query), values.shape[1]))
    if len(time) == 1:
        result[:] = values
        return result
    inside = np.clip(query, time[0], time[-1])
    for start in range(0, len(query), BLOCK_ROWS):
        block = inside[start : start + BLOCK_ROWS]
        first, last = np.searchsorted(time, block[[0, -1]])
        near = slice(max(0, int(first) - margin), int(last) + margin)
        result[start : start + BLOCK_ROWS] = scipy.interpolate.CubicSpline(time[near], values[near])(block)
    return result


def previous(query: Array, time: Array, values: NDArray[np.generic]) -> NDArray[np.generic]:
    """Return the last value at or before each `query`; before the first sample, the first value."""
    return np.asarray(values[np.maximum(np.searchsorted(time, query, side="right") - 1, 0)])


def slerp(query: Array, time: Array, quaternions: Array) -> Array:
    """Interpolate unit quaternions of arbitrary sign on the shortest great arc between samples, shape (Q, 4)."""
    result = allocate((len(query), 4))
    if len(time) == 1:
        result[:] = quaternions
        return result
    size = np.linalg.norm(quaternions, axis=1, keepdims=True)
    known = quaternions / np.where(size > 0, size, np.nan)
    for start in range(0, len(query), BLOCK_ROWS):
        rows = slice(start, start + BLOCK_ROWS)
        index, share = _bracket(query[rows], time)
        cosine = np.einsum("qi,qi->q", known[index], known[index + 1])
        angle = np.arccos(np.minimum(np.abs(cosine), 1.0)) / np.pi
        before, after = (part * np.sinc(part * angle) / np.sinc(angle) for part in (1 - share, share))
        result[rows] = before[:, None] * known[index] + np.copysign(after, cosine)[:, None] * known[index + 1]
    return result


def bridges(query: Array, time: Array, longest: float) -> BoolArray:
    """Find queries outside the samples, or strictly between two samples farther apart than `longest`."""
    if len(time) == 1:
        return np.asarray(query != time[0])
    index, share = _bracket(query, time)
    on_sample = (share == 0) | (share == 1)
    outside = (query < time[0]) | (query > time[-1])
    return np.asarray(outside | (~on_sample & (time[index + 1] - time[index] > longest)))


def _bracket(query: Array, time: Array) -> tuple[IntArray, Array]:
    """Find the index of the sample before each query, and the share of the way to the next one, in 0...1."""
    index = np.clip(np.searchsorted(time, query, side="right") - 1, 0, len(time) - 2)
    step = time[index + 1] - time[index]
    share = np.divide(query - time[index], step, out=np.zeros(len(query)), where=step > 0)
    return index, np.clip(share, 0.0, 1.0)


KINDS: dict[str, Callable[[Array, Array, Any], NDArray[Any]]] = {
    "position": cubic,
    "velocity": cubic,
    "base_orientation": slerp,
    "contact": previous,
}
"""Interpolation by channel: splines for smooth signals, the previous value for flags, otherwise linear."""


def on_uniform_clock(log: RobotLog, segments: tuple[slice, ...], period: float) -> tuple[RobotLog, tuple[slice, ...]]:
    """Resample the log every `period` [s] from the start of each segment to its end; return the new segments too."""
    clocks = [_make_clock(log.time[part], period) for part in segments]
    ends = np.cumsum([len(clock) for clock in clocks]).tolist()
    parts = tuple(slice(start, stop) for start, stop in zip([0, *ends[:-1]], ends, strict=True))
    even: dict[str, NDArray[Any]] = {"time": np.concatenate(clocks)}
    for name, channel in log.channels().items():
        if name == "time":
            continue
        shape = (ends[-1], *channel.shape[1:])
        even[name] = np.empty(shape, dtype=bool) if channel.dtype == bool else allocate(shape)
        interpolate = KINDS.get(name, linear)
        for clock, old, new in zip(clocks, segments, parts, strict=True):
            even[name][new] = interpolate(clock, log.time[old], channel[old])
    return replace(log, **even), parts  # type: ignore[arg-type]


def _make_clock(time: Array, period: float) -> Array:
    steps = int(np.floor((time[-1] - time[0]) / period + 1e-6))  # keep a last sample that rounding moves beyond the end
    return np.asarray(np.minimum(time[0] + period * np.arange(steps + 1), time[-1]))


def delayed(signal: Array, time: Array, delay: Array) -> Array:
    """Delay each column of a signal, shape (T, n), by its delay [s], shape (n,); rows without a stamp are not used."""
    result, known = allocate(signal.shape), np.isfinite(time)
    for column, lag in enumerate(delay.tolist()):
        result[:, column] = np.interp(time - lag, time[known], signal[known, column]) if lag else signal[:, column]
    return result


def with_command_delay(log: RobotLog, delay: Array) -> RobotLog:
    """Compute the torques of a log anew for commands that act a delay per joint [s], shape (n,), later."""
    assert log.command is not None
    assert log.feedback is not None
    command = delayed(log.command, log.time, delay)
    limits = np.array(log.effort_limits)
    return replace(log, command=command, torque=np.clip(command + log.feedback, -limits, limits))
