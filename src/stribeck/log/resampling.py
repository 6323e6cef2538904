"""A log's segments interpolated to a uniform clock, each for itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stribeck.log import RobotLog
from stribeck.log.interpolation import cubic, linear, previous, slerp
from stribeck.log.storage import allocate
from stribeck.typing import Array

KINDS: dict[str, Callable[[Array, Array, Any], NDArray[Any]]] = {
    "position": cubic,
    "velocity": cubic,
    "base_orientation": slerp,
    "contact": previous,
}
"""Smooth signals by splines, flags by the value before; everything else on straight lines, which ring at no step."""


def on_uniform_clock(log: RobotLog, segments: tuple[slice, ...], period: float) -> tuple[RobotLog, tuple[slice, ...]]:
    """Return the log with a sample every `period` [s] from the start of each segment to its end, and the segments."""
    clocks = [_clock(log.time[part], period) for part in segments]
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


def _clock(time: Array, period: float) -> Array:
    steps = int(np.floor((time[-1] - time[0]) / period + 1e-6))  # a last sample that rounding puts beyond the end stays
    clock: Array = np.minimum(time[0] + period * np.arange(steps + 1), time[-1])
    return clock
