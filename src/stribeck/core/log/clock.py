"""Clock of a log: period, regularity, and resampling to an even clock."""

from dataclasses import replace

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.errors import LogError
from stribeck.core.log import RobotLog
from stribeck.core.log.interpolation import on_uniform_clock

TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}  # [s]
RATES = (9.0, 100e3)  # [Hz]; slower logs miss the robot's motion, faster ones do not exist
TOLERANCE = 0.01  # periods; smaller deviations count as uniform
STEP = 1.5  # periods; in a longer step a sample is missing
BRIDGED = 0.01  # [s], steps that are always interpolated: a quarter of the windows of estimators
REPEATED = 0.8  # share of different stamps; fewer come from a clock that is coarser than the rows


def refuse_wrong_time(time: Array, path: str) -> None:
    """Raise a LogError if time decreases or jumps, because a stamp is damaged or the clock was set."""
    rows = np.flatnonzero(np.isfinite(time))
    steps = np.diff(time[rows])
    if len(back := np.flatnonzero(steps < 0)):
        before, after = rows[back[0]], rows[back[0] + 1]
        raise LogError(
            f"{path or 'log'}: time runs backwards in row {after}, from {time[before]:.9g} s to {time[after]:.9g} s; "
            "expected increasing stamps (split the log there, or sort it)"
        )
    if steps.size and steps.max() > 1e8:  # [s]; three years, longer than any recording
        before = rows[int(np.argmax(steps))]
        raise LogError(
            f"{path or 'log'}: time jumps by {steps.max():.4g} s after row {before}, from {time[before]:.9g} s; "
            "expected the stamps of one clock (split the log there)"
        )


def typical_step(time: Array, where: str) -> float:
    """Compute the median step [s] between different stamps; refuse rates that no robot's log has."""
    every = np.diff(time)
    steps = every[every > 0]
    if not steps.size:
        raise LogError(f"{where}: all stamps are {time[0]:.9g} s; expected increasing time, or [log] rate in Hz")
    step = float(np.median(steps))
    if not RATES[0] < 1 / step <= RATES[1] and len(steps) < REPEATED * len(every):
        raise LogError(
            f"{where}: only {len(steps)} of {len(every)} steps of 'time' are not zero, as from a coarse clock; if the "
            f"rows are evenly spaced, set [log] rate = {rate_of_rows(time):.4g}"
        )
    if not RATES[0] <= 1 / step <= RATES[1]:
        units = plausible_units(step)
        remedy = f'; [log.time] unit = "{units[0]}" would make it {1 / (step * TIME[units[0]]):.6g} Hz' if units else ""
        raise LogError(
            f"{where}: the step of 'time' is {step:.6g} s, a rate of {1 / step:.6g} Hz; "
            f"expected {RATES[0]:g} Hz to {RATES[1]:g} Hz{remedy}"
        )
    return step


def plausible_units(step: float) -> list[str]:
    """List the units of time that make a step plausible for a robot's log, largest first."""
    return [unit for unit, factor in TIME.items() if 1 / RATES[1] <= step * factor <= 1 / RATES[0]]


def longest_step(step: float, max_gap: float | None) -> float:
    """Return the longest step [s] that is interpolated, given the typical one; jitter of a scheduler is no gap."""
    return max_gap or max(STEP * step, BRIDGED)


def mean_step(time: Array, segments: tuple[slice, ...]) -> float:
    """Compute the step [s] of the least-squares line through the stamps, with one slope for all segments."""
    covariance, variance = 0.0, 0.0
    for part in segments:
        row = _centred_rows(part)
        covariance += float(row @ (time[part] - time[part.start]))
        variance += float(row @ row)
    return covariance / variance


def rate_of_rows(time: Array) -> float:
    """Compute the rate [Hz] of evenly spaced rows whose stamps come from a coarse clock."""
    return 1 / mean_step(time, (slice(0, len(time)),))


def _centred_rows(part: slice) -> Array:
    count = part.stop - part.start
    return np.asarray(np.arange(count) - (count - 1) / 2)


def even(
    log: RobotLog, segments: tuple[slice, ...], period: float, jitter: float
) -> tuple[RobotLog, tuple[slice, ...], float, list[str]]:
    """Resample the log to a uniform clock in each segment if necessary, and return its period [s] and notes.

    A log is unchanged, gets new stamps, or is interpolated.
    """
    rounding = 0.55  # grains; rounding moves a stamp by half a grain, and the fitted line a little
    if jitter <= TOLERANCE * period and not _drifts(log.time, segments, period):
        return log, segments, period, []
    grain = _find_resolution(log.time)
    time = _restamp(log.time, segments, period)
    if np.abs(time - log.time).max() <= rounding * grain < rounding * period:
        note = f"Stamps are rounded to {1e3 * grain:.4g} ms and were replaced by evenly spaced ones."
        return replace(log, time=time), segments, period, [note]
    even, parts = on_uniform_clock(log, segments, period)
    of_all = mean_step(log.time, segments)  # late stamps cause long steps, then short ones
    time = _restamp(log.time, segments, of_all)
    shift = float(np.abs(time - log.time).max())
    if shift <= BRIDGED and _is_smoother(log, segments, even, parts):
        note = (
            f"Stamps are up to {1e3 * shift:.4g} ms early or late (the motion is much smoother with evenly spaced "
            "ones) and were replaced."
        )
        return replace(log, time=time), segments, of_all, [note]
    note = (
        f"Steps of the stamps differ from the period by up to {1e3 * jitter:.4g} ms: the log is interpolated to "
        f"{1 / period:.6g} Hz, from {len(log.time)} to {len(even.time)} rows."
    )
    return even, parts, period, [note]


def _restamp(time: Array, segments: tuple[slice, ...], period: float) -> Array:
    """Compute evenly spaced stamps around the mean of each segment."""
    return np.concatenate([np.mean(time[part]) + period * _centred_rows(part) for part in segments])


def _is_smoother(log: RobotLog, rows: tuple[slice, ...], even: RobotLog, parts: tuple[slice, ...]) -> bool:
    """Return whether positions are much smoother by rows than by stamps; then the stamps were wrong."""
    as_rows, by_stamps = _compute_roughness(log, rows), _compute_roughness(even, parts)
    both = as_rows + by_stamps
    share = np.divide(as_rows, both, out=np.full_like(both, 0.5), where=both > 0)
    return bool(np.mean(share) < 0.33)


def _compute_roughness(log: RobotLog, segments: tuple[slice, ...]) -> Array:
    """Compute the mean fourth difference of each position, shape (n,); wrong stamps make it large."""
    differences = [np.abs(np.diff(log.position[part], 4, axis=0)) for part in segments]
    return np.asarray(sum(part.sum(axis=0) for part in differences) / max(sum(len(part) for part in differences), 1))


def _drifts(time: Array, segments: tuple[slice, ...], period: float) -> bool:
    """Return whether a segment has another rate than the log, by more than jitter of its ends explains."""
    for part in segments:
        steps = part.stop - part.start - 1
        error = abs(float(time[part.stop - 1] - time[part.start]) / period - steps)
        if error > max(1e-3 * steps, 2 * TOLERANCE):
            return True
    return False


def _find_resolution(time: Array) -> float:
    """Find the step that stamps are rounded to [s], from single precision or from decimals."""
    grains = [float(np.spacing(np.float32(np.abs(time).max())))] if np.all(time == time.astype(np.float32)) else []
    for decimals in range(2, 7):
        scaled = time * 10.0**decimals
        if np.abs(scaled - np.round(scaled)).max() < 1e-3:
            grains.append(10.0**-decimals)
            break
    return max(grains, default=0.0)
