"""Which rows of a log are complete, and a log of them alone."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.log import RobotLog
from stribeck.log.readers.recording import QUATERNION, WRENCH
from stribeck.log.storage import allocate

LARGEST = 1e12  # in SI units; nothing a robot measures comes near it, and squares of it can still be summed


def without_empty_channels(log: RobotLog) -> tuple[RobotLog, list[str]]:
    """Leave out optional channels that hold nothing in some column."""
    empty: dict[str, None] = {}
    for name in ("velocity", "acceleration", "angular_velocity", "linear_acceleration"):
        channel = getattr(log, name)
        if channel is not None and any(not np.isfinite(column).any() for column in channel.T):
            empty[name] = None
    notes = [f"'{name}' is left out: a column of it has no values at all." for name in empty]
    return (replace(log, **empty) if empty else log), notes  # type: ignore[arg-type]


def complete_rows(log: RobotLog) -> tuple[NDArray[np.bool_], dict[str, int]]:
    """Return which rows have all values, and how many values each column lacks or cannot mean."""
    keep = np.ones(len(log.time), dtype=bool)
    missing: dict[str, int] = {}
    for name, channel in log.channels().items():
        if name in ("temperature", "contact"):  # no filter meets them
            continue
        for index, column in enumerate(channel.reshape(len(keep), -1).T):
            known = np.isfinite(column) if name == "time" else np.abs(column) < LARGEST
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
        return f"{channel}.{log.foot_names[index // 6]}.{WRENCH[index % 6]}"
    if channel == "foot_force":
        return f"{channel}.{log.foot_names[index]}"
    if channel in ("base_orientation", "angular_velocity", "linear_acceleration"):
        return f"{channel}.{QUATERNION[index]}"
    return f"{channel}.{log.joint_names[index]}"


def counts(missing: dict[str, int]) -> str:
    """Return the columns that lack most, for a message."""
    worst = sorted(missing.items(), key=lambda item: -item[1])
    text = ", ".join(f"{name} ({count})" for name, count in worst[:6])
    return text + (f" and {len(worst) - 6} more columns" if len(worst) > 6 else "")


def repeats(time: Array, keep: NDArray[np.bool_], period: float) -> NDArray[np.int64]:
    """Return the kept rows whose stamp is that of the kept row before."""
    rows = np.flatnonzero(keep)
    return rows[1:][np.diff(time[rows]) < 0.05 * period]  # so soon after the last, it is the same sample again


def cut(log: RobotLog, keep: NDArray[np.bool_]) -> RobotLog:
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
