"""Selection of the complete rows of a log."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.log import RobotLog
from stribeck.log.readers.recording import QUATERNION, WRENCH
from stribeck.log.storage import allocate

LARGEST = 1e12  # in SI units; larger than any measurement of a robot, and sums of its squares do not overflow


def without_empty_channels(log: RobotLog) -> tuple[RobotLog, list[str]]:
    """Remove optional channels with an empty column."""
    empty: dict[str, None] = {}
    for name in ("velocity", "acceleration", "angular_velocity", "linear_acceleration"):
        channel = getattr(log, name)
        if channel is not None and any(not np.isfinite(column).any() for column in channel.T):
            empty[name] = None
    notes = [f"'{name}' is ignored: one of its columns has no values." for name in empty]
    return (replace(log, **empty) if empty else log), notes  # type: ignore[arg-type]


def complete_rows(log: RobotLog) -> tuple[NDArray[np.bool_], dict[str, int]]:
    """Find the complete rows, and count the missing or implausible values of each column."""
    keep = np.ones(len(log.time), dtype=bool)
    missing: dict[str, int] = {}
    for name, channel in log.channels().items():
        if name in ("temperature", "contact"):  # these are not filtered
            continue
        for index, column in enumerate(channel.reshape(len(keep), -1).T):
            known = np.isfinite(column) if name == "time" else np.abs(column) < LARGEST
            if not known.all():
                keep &= known
                missing[_name_column(log, name, index)] = int(len(known) - known.sum())
    if log.base_orientation is not None:  # zeros, which IMUs send before they are ready
        void = ~log.base_orientation.any(axis=1)
        if void.any():
            keep &= ~void
            missing["base_orientation"] = int(void.sum())
    return keep, missing


def _name_column(log: RobotLog, channel: str, index: int) -> str:
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
    """List the columns with the most missing values, for a message."""
    worst = sorted(missing.items(), key=lambda item: -item[1])
    text = ", ".join(f"{name} ({count})" for name, count in worst[:6])
    return text + (f" and {len(worst) - 6} more columns" if len(worst) > 6 else "")


def repeats(time: Array, keep: NDArray[np.bool_], period: float) -> NDArray[np.int64]:
    """Find the kept rows whose stamp repeats the previous kept one."""
    rows = np.flatnonzero(keep)
    return rows[1:][np.diff(time[rows]) < 0.05 * period]  # so soon after the last, it is the same sample


def cut(log: RobotLog, keep: NDArray[np.bool_]) -> RobotLog:
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
