"""Conversion of a recorded log to segments of uniformly sampled, complete rows."""

import json
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.errors import LogError, findings_kept
from stribeck.core.log import RobotLog, clock
from stribeck.core.log.channels import column_names
from stribeck.core.log.plausibility import check_plausible
from stribeck.core.log.storage import allocate
from stribeck.core.settings import LogTable

FEWEST = 16  # rows; fewer are too short for filters
SHORT = 0.12  # [s]; shorter segments are too short for filters and windows of estimators


@dataclass(frozen=True, kw_only=True)
class Sampling:
    """Sampling of a log, and the changes made to it.

    Attributes
    ----------
    rate, period
        Rate [Hz] and period [s] of the returned log.
    jitter
        Largest deviation of a step from the period in the recorded log [s].
    gaps
        (last row before, first row after) each gap [s].
    duplicates
        Number of rows removed because their stamp repeats the previous one.
    missing
        Number of rows removed because of a missing value, by column: {"position.<joint>": rows, ...}.
    segments
        Rows of the returned log between gaps, in order; together they are all rows. Filters and derivatives must not
        cross them.
    lost
        Share of the rows that are removed, or in segments too short to use [1].
    notes
        Changes, one sentence each.
    """

    rate: float
    period: float
    jitter: float
    gaps: tuple[tuple[float, float], ...]
    duplicates: int
    missing: dict[str, int]
    segments: tuple[slice, ...]
    lost: float
    notes: tuple[str, ...]


@np.errstate(over="ignore", invalid="ignore")  # damaged numbers may overflow; such rows are removed
def regularise(log: RobotLog, log_table: LogTable) -> tuple[RobotLog, Sampling]:
    """Make the segments of a log uniformly sampled and complete; a log that already is comes back uncopied.

    Repeated stamps and rows with missing values are removed, gaps split the log, and jittering stamps are replaced by a
    uniform clock: positions and velocities by cubic splines, orientations on great arcs, contact flags by the previous
    value, other channels by linear interpolation.

    Parameters
    ----------
    log_table
        `max_gap` overrides the longest step [s] that is interpolated, `clock.longest_step`.

    Raises
    ------
    LogError
        If time decreases, cannot be in seconds, hardly a row is complete, or values are implausible
        (`stribeck.core.log.plausibility`).
    """
    where, rows = log.path or "log", len(log.time)
    clock.refuse_wrong_time(log.time, log.path)
    log, missing, duplicates, notes = _remove_incomplete(log, where)
    step = clock.typical_step(log.time, where)
    longest = clock.longest_step(step, log_table.max_gap)
    segments, gaps = _split(log.time, longest)
    if max(part.stop - part.start for part in segments) < FEWEST:
        raise LogError(
            f"{where}: no segment has {FEWEST} rows without a step longer than {longest:.6g} s (typical step: "
            f"{step:.6g} s); allow longer steps with [log] max_gap"
        )
    excluded = [(log.start + low, log.start + high) for low, high, _ in log.excluded]
    gaps = tuple(gap for gap in gaps if not any(gap[0] < low and high <= gap[1] for low, high in excluded))
    if gaps:
        notes.append(f"{len(gaps)} gaps longer than {longest:.4g} s split the log; nothing is filtered across them.")
    usable = [part.stop - part.start for part in segments if log.time[part.stop - 1] - log.time[part.start] >= SHORT]
    lost = 1 - sum(usable) / rows
    if lost > 0 and len(segments) > len(usable):
        notes.append(
            f"{100 * lost:.3g} % of the samples are not used: they were removed, or are in segments between gaps "
            f"shorter than {SHORT:g} s."
        )
    with findings_kept(notes):
        notes += check_plausible(log)
    period = clock.mean_step(log.time, _split(log.time, clock.STEP * step)[0])  # even if longer steps are interpolated
    jitter = max(float(np.abs(np.diff(log.time[part]) - period).max(initial=0)) for part in segments)
    log, segments, period, how = clock.even(_normalize_orientation(log), segments, period, jitter)
    return log, Sampling(
        rate=1 / period,
        period=period,
        jitter=jitter,
        gaps=gaps,
        duplicates=duplicates,
        missing=missing,
        segments=segments,
        lost=lost,
        notes=(*notes, *how),
    )


def _remove_incomplete(log: RobotLog, where: str) -> tuple[RobotLog, dict[str, int], int, list[str]]:
    """Keep complete rows with different stamps; return missing values, number of repeated stamps, and notes."""
    log, notes = _without_empty_channels(log)
    keep, missing = _complete_rows(log)
    complete = int(keep.sum())
    if len(keep) < FEWEST:
        raise LogError(f"{where}: the log has {len(keep)} samples; expected at least {FEWEST}")
    if complete < max(FEWEST, 0.02 * len(keep)):
        idle = [name.removeprefix("torque.") for name, count in missing.items() if count == len(keep)]
        idle = [name for name in idle if name in log.joint_names]
        remedy = f"; joints without torque belong in [robot] position_controlled = {json.dumps(idle)}" if idle else ""
        raise LogError(
            f"{where}: only {complete} of {len(keep)} rows are complete; missing: {_counts(missing)}{remedy}"
        )
    if missing:
        notes.append(f"{len(keep) - complete} rows with missing values were removed: {_counts(missing)}.")
    again = _repeats(log.time, keep, clock.typical_step(log.time[keep], where))
    moved = np.any(log.position[again] != log.position[again - 1], axis=1)
    coarse = len(again) > (1 - clock.REPEATED) * complete and np.mean(moved) > 0.5
    rate = clock.rate_of_rows(log.time[keep])
    remedy = f"; if the rows are evenly spaced, set [log] rate = {rate:.4g}" if coarse else ""
    keep[again] = False
    if len(again):
        notes.append(f"{len(again)} rows with repeated stamps were removed{remedy}.")
    return _cut(log, keep), missing, len(again), notes


def _without_empty_channels(log: RobotLog) -> tuple[RobotLog, list[str]]:
    """Remove optional channels with an empty column."""
    empty: dict[str, None] = {}
    for name in ("velocity", "acceleration", "angular_velocity", "linear_acceleration"):
        channel = getattr(log, name)
        if channel is not None and any(not np.isfinite(column).any() for column in channel.T):
            empty[name] = None
    notes = [f"'{name}' is ignored: one of its columns has no values." for name in empty]
    return (replace(log, **empty) if empty else log), notes  # type: ignore[arg-type]


def _complete_rows(log: RobotLog) -> tuple[BoolArray, dict[str, int]]:
    """Find the complete rows, and count the missing or implausible values of each column."""
    jump = 0.1  # [rad] or [m]; no robot jumps so far from zero in all joints, and back
    largest = 1e12  # in SI units; larger than any measurement of a robot, and sums of its squares do not overflow
    keep = np.ones(len(log.time), dtype=bool)
    missing: dict[str, int] = {}
    for name, channel in log.channels().items():
        if name in ("temperature", "contact"):  # these are not filtered
            continue
        for label, column in zip(column_names(log, name), channel.reshape(len(keep), -1).T, strict=True):
            known = np.isfinite(column) if name == "time" else np.abs(column) < largest
            if not known.all():
                keep &= known
                missing[label] = int(len(known) - known.sum())
    ghost = np.asarray(~log.position.any(axis=1), dtype=bool)
    if ghost.any() and not ghost.all():  # zeros, which a second publisher sends between the real positions
        far = np.abs(log.position[~ghost]).max(axis=1)
        ghost = ghost & (np.interp(np.arange(len(ghost)), np.flatnonzero(~ghost), np.nan_to_num(far)) > jump)
        if ghost.any():
            keep &= ~ghost
            missing["all positions zero"] = int(ghost.sum())
    if log.base_orientation is not None:  # zeros, which IMUs send before they are ready
        void = ~log.base_orientation.any(axis=1)
        if void.any():
            keep &= ~void
            missing["base_orientation"] = int(void.sum())
    return keep, missing


def _counts(missing: dict[str, int]) -> str:
    """List the columns with the most missing values, for a message."""
    worst = sorted(missing.items(), key=lambda item: -item[1])
    text = ", ".join(f"{name} ({count})" for name, count in worst[:6])
    return text + (f" and {len(worst) - 6} more columns" if len(worst) > 6 else "")


def _repeats(time: Array, keep: BoolArray, period: float) -> IntArray:
    """Find the kept rows whose stamp repeats the previous kept one."""
    rows = np.flatnonzero(keep)
    return rows[1:][np.diff(time[rows]) < 0.05 * period]  # so soon after the last, it is the same sample


def _cut(log: RobotLog, keep: BoolArray) -> RobotLog:
    """Select rows; a selection of all rows is not copied."""
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
    """Find the segments between steps longer than `longest` [s], and those steps."""
    ends = np.flatnonzero(np.diff(time) > longest) + 1
    segments = tuple(slice(*edges) for edges in pairwise([0, *ends.tolist(), len(time)]))
    return segments, tuple((float(time[end - 1]), float(time[end])) for end in ends)


def _normalize_orientation(log: RobotLog) -> RobotLog:
    if log.base_orientation is None:
        return log
    norm = np.linalg.norm(log.base_orientation, axis=1, keepdims=True)
    if np.abs(norm - 1).max() < 1e-9:
        return log
    return replace(log, base_orientation=log.base_orientation / norm)
