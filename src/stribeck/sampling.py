"""From a log as it was recorded to segments of uniformly sampled, complete rows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from stribeck.errors import LogError
from stribeck.log import Array, RobotLog
from stribeck.plausibility import check_plausible
from stribeck.readers.mapping import refuse_backward_time
from stribeck.resampling import on_uniform_clock
from stribeck.settings import LogTable
from stribeck.storage import allocate

RATES = (20.0, 100e3)  # [Hz]; below, no robot's motion can be followed; above, no joint is logged
REPEATED = 0.05  # periods; a stamp that comes sooner after the last one is the same sample again
TOLERANCE = 0.01  # periods; stamps that are off by less are uniform
FEWEST = 16  # rows; less than that supports no filter
LEAST_SHARE = 0.02  # of the rows; where less is left, the log is not what it seems
OPTIONAL = ("velocity", "acceleration", "angular_velocity", "linear_acceleration")
"""Channels that are left out when a column of them is missing all through; the others decide which rows are kept."""


@dataclass(frozen=True, kw_only=True)
class Sampling:
    """How a log was sampled, and what was done about it.

    Attributes
    ----------
    rate, period
        Of the returned log [Hz], [s].
    jitter
        Largest deviation of a step from the period, in the log as it was recorded [s].
    gaps
        (last row before, first row after) each gap [s].
    duplicates
        Rows left out because their stamp repeats the one before.
    missing
        Rows left out because of a missing value, by column: {"position.<joint>": rows, ...}.
    segments
        Rows of the returned log between gaps, in order; together they are all rows. Nothing may be filtered or
        differentiated across them.
    notes
        A sentence each about what was done.
    """

    rate: float
    period: float
    jitter: float
    gaps: tuple[tuple[float, float], ...]
    duplicates: int
    missing: dict[str, int]
    segments: tuple[slice, ...]
    notes: tuple[str, ...]


def regularise(log: RobotLog, log_table: LogTable) -> tuple[RobotLog, Sampling]:
    """Return a log whose segments are uniformly sampled and complete; a log that is already so comes back uncopied.

    Repeated stamps and rows with missing values are cut out, gaps split the log, and stamps that jitter are replaced
    by a uniform clock: positions and velocities by cubic splines, orientations on great arcs, contact flags by the
    value before, the rest on straight lines.

    Parameters
    ----------
    log_table
        `max_gap` is the longest step [s] that is still interpolated; 1.5 periods if it is not set.

    Raises
    ------
    LogError
        If time runs backwards, its unit cannot be seconds, hardly a row is complete, or values cannot be meant
        (`stribeck.plausibility`).
    """
    where = log.path or "log"
    refuse_backward_time(log.time, log.path)
    log, notes = _without_empty_channels(log)
    keep, missing = _complete_rows(log)
    if keep.sum() < max(FEWEST, LEAST_SHARE * len(keep)):
        raise LogError(
            f"{where}: {keep.sum()} of {len(keep)} rows are complete; missing values are in {_counts(missing)}"
        )
    period = _typical_step(log.time[keep], where)
    repeats = _repeats(log.time, keep, period)
    keep[repeats] = False
    log = _cut(log, keep)
    if missing:
        notes.append(
            f"{len(keep) - keep.sum() - len(repeats)} rows with missing values are cut out: {_counts(missing)}."
        )
    if len(repeats):
        notes.append(f"{len(repeats)} rows whose stamp repeats the one before are cut out.")
    longest = log_table.max_gap or 1.5 * period
    segments, gaps = _split(log.time, longest)
    if max(part.stop - part.start for part in segments) < FEWEST:
        raise LogError(
            f"{where}: no stretch of {FEWEST} rows is without a step longer than {longest:.6g} s (the typical one is "
            f"{period:.6g} s); allow longer steps with [log] max_gap"
        )
    if gaps:
        notes.append(f"{len(gaps)} gaps longer than {longest:.4g} s split the log; nothing is filtered across them.")
    notes += check_plausible(log)
    log = _unit_orientation(log)
    period = _mean_step(log.time, segments)
    jitter = max(float(np.abs(np.diff(log.time[part]) - period).max(initial=0)) for part in segments)
    log, segments, how = _even(log, segments, period)
    sampling = Sampling(
        rate=1 / period,
        period=period,
        jitter=jitter,
        gaps=gaps,
        duplicates=len(repeats),
        missing=missing,
        segments=segments,
        notes=(*notes, *how),
    )
    return log, sampling


def _without_empty_channels(log: RobotLog) -> tuple[RobotLog, list[str]]:
    """Leave out optional channels that hold nothing in some column."""
    empty: dict[str, None] = {}
    for name in OPTIONAL:
        channel = getattr(log, name)
        if channel is not None and any(not np.isfinite(column).any() for column in channel.T):
            empty[name] = None
    notes = [f"'{name}' is left out: a column of it has no values at all." for name in empty]
    return (replace(log, **empty) if empty else log), notes


def _complete_rows(log: RobotLog) -> tuple[NDArray[np.bool_], dict[str, int]]:
    """Return which rows have all values, and how many values each column lacks."""
    keep = np.ones(len(log.time), dtype=bool)
    missing: dict[str, int] = {}
    for name, channel in log.channels().items():
        if name in ("temperature", "contact"):  # no filter meets them
            continue
        for index, column in enumerate(channel.reshape(len(keep), -1).T):
            known = np.isfinite(column)
            if not known.all():
                keep &= known
                missing[_column_name(log, name, index)] = int(len(known) - known.sum())
    if log.base_orientation is not None:  # what an IMU sends before it knows better
        void = ~log.base_orientation.any(axis=1)
        if void.any():
            keep &= ~void
            missing["base_orientation"] = int(void.sum())
    return keep, missing


def _column_name(log: RobotLog, channel: str, index: int) -> str:
    if channel == "time":
        return "time"
    if channel == "foot_wrench":
        return f"{channel}.{log.foot_names[index // 6]}.{('fx', 'fy', 'fz', 'tx', 'ty', 'tz')[index % 6]}"
    if channel in ("base_orientation", "angular_velocity", "linear_acceleration"):
        return f"{channel}.{'xyzw'[index]}"
    return f"{channel}.{log.joint_names[index]}"


def _counts(missing: dict[str, int]) -> str:
    """Return the columns that lack most, for a message."""
    worst = sorted(missing.items(), key=lambda item: -item[1])
    text = ", ".join(f"{name} ({count})" for name, count in worst[:6])
    return text + (f" and {len(worst) - 6} more columns" if len(worst) > 6 else "")


def _typical_step(time: Array, where: str) -> float:
    """Return the median step [s] between different stamps, refused where it cannot be one of a robot's log."""
    steps = np.diff(time)
    steps = steps[steps > 0]
    if not steps.size:
        raise LogError(f"{where}: all stamps are {time[0]:.9g} s; expected time that rises")
    step = float(np.median(steps))
    if not RATES[0] <= 1 / step <= RATES[1]:
        factors = {"ms": 1e-3, "us": 1e-6, "ns": 1e-9, "s": 1.0}
        cures = [unit for unit, factor in factors.items() if RATES[0] <= 1 / (step * factor) <= RATES[1]]
        cure = (
            f'; [log.time] unit = "{cures[0]}" would make it {1 / (step * factors[cures[0]]):.6g} Hz' if cures else ""
        )
        raise LogError(
            f"{where}: the step of 'time' is {step:.6g} s, a rate of {1 / step:.6g} Hz; "
            f"expected {RATES[0]:g} Hz to {RATES[1]:g} Hz{cure}"
        )
    return step


def _repeats(time: Array, keep: NDArray[np.bool_], period: float) -> NDArray[np.int64]:
    """Return the kept rows whose stamp is that of the kept row before."""
    rows = np.flatnonzero(keep)
    return rows[1:][np.diff(time[rows]) < REPEATED * period]


def _cut(log: RobotLog, keep: NDArray[np.bool_]) -> RobotLog:
    """Return the log of some rows; itself if these are all of them."""
    if keep.all():
        return log
    rows = int(keep.sum())
    cut = {}
    for name, channel in log.channels().items():
        shape = (rows, *channel.shape[1:])
        target = np.empty(shape, dtype=bool) if channel.dtype == bool else allocate(shape)
        cut[name] = np.compress(keep, channel, axis=0, out=target)
    return replace(log, **cut)  # type: ignore[arg-type]


def _split(time: Array, longest: float) -> tuple[tuple[slice, ...], tuple[tuple[float, float], ...]]:
    """Return the segments between steps longer than `longest` [s], and those steps."""
    ends = np.flatnonzero(np.diff(time) > longest) + 1
    edges = [0, *ends.tolist(), len(time)]
    segments = tuple(slice(start, stop) for start, stop in pairwise(edges))
    return segments, tuple((float(time[end - 1]), float(time[end])) for end in ends)


def _mean_step(time: Array, segments: tuple[slice, ...]) -> float:
    """Return the mean step within segments [s], which jitter does not bias."""
    duration = sum(float(time[part.stop - 1] - time[part.start]) for part in segments)
    return duration / float(sum(part.stop - part.start - 1 for part in segments))


def _unit_orientation(log: RobotLog) -> RobotLog:
    if log.base_orientation is None:
        return log
    norm = np.linalg.norm(log.base_orientation, axis=1, keepdims=True)
    if np.abs(norm - 1).max() < 1e-9:
        return log
    return replace(log, base_orientation=log.base_orientation / norm)


def _even(log: RobotLog, segments: tuple[slice, ...], period: float) -> tuple[RobotLog, tuple[slice, ...], list[str]]:
    """Return the log on a uniform clock in each segment: as it is, restamped, or interpolated."""
    off = max(_unevenness(log.time[part]) for part in segments)
    if off <= TOLERANCE * period:
        return log, segments, []
    grain = _resolution(log.time)
    if off <= 0.55 * grain and grain < period:  # rounding moves a stamp by half a grain
        time = log.time.copy()
        for part in segments:
            time[part] = np.linspace(time[part.start], time[part.stop - 1], part.stop - part.start)
        note = f"Stamps are rounded to {1e3 * grain:.4g} ms: evenly spaced stamps take their place."
        return replace(log, time=time), segments, [note]
    even, parts = on_uniform_clock(log, segments, period)
    note = (
        f"Stamps are off a uniform clock by up to {1e3 * off:.4g} ms: the log is interpolated to "
        f"{1 / period:.6g} Hz, from {len(log.time)} to {len(even.time)} rows."
    )
    return even, parts, [note]


def _unevenness(time: Array) -> float:
    """Return how far stamps are from evenly spaced ones between the first and the last [s]."""
    return float(np.abs(time - np.linspace(time[0], time[-1], len(time))).max())


def _resolution(time: Array) -> float:
    """Return the step that stamps seem rounded to [s]: of single precision, or of decimals."""
    grains = [float(np.spacing(np.float32(np.abs(time).max())))] if np.all(time == time.astype(np.float32)) else []
    for decimals in range(2, 7):
        scaled = time * 10.0**decimals
        if np.abs(scaled - np.round(scaled)).max() < 1e-3:
            grains.append(10.0**-decimals)
            break
    return max(grains, default=0.0)
