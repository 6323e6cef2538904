"""Writers of logs, with names that `read_log` reads without any setting."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet
from numpy.typing import NDArray

from stribeck.core.base.outputs import whole_or_not_at_all
from stribeck.core.errors import LogError
from stribeck.core.log.channels import column_names
from stribeck.core.log.robot_log import RobotLog
from stribeck.core.log.storage import BLOCK_ROWS


def write_log(log: RobotLog, path: str | Path) -> None:
    """Write a log in SI units, with names that `read_log` reads without any setting; whole or not at all.

    Parameters
    ----------
    log
        Log to write. Irregular time and missing values (NaN) are written unchanged.
    path
        Path of a `.npz` or `.parquet` file; an existing file is replaced.

    Raises
    ------
    LogError
        If the suffix is unknown, or torques are currents.
    SettingsError
        If the file cannot be written.

    Examples
    --------
    >>> write_log(read_log("log.npz"), "log.parquet")
    """
    target = Path(path)
    if target.suffix not in WRITERS:
        raise LogError(f"{target}: unknown suffix '{target.suffix}'; expected {' or '.join(WRITERS)}")
    if log.unscaled and log.command is None:
        raise LogError(
            f"{log.path or 'log'}: torques of {', '.join(log.unscaled)} are in amperes, but logs are "
            "written in N m; set [robot.motors.<joint>] torque_constant"
        )
    with whole_or_not_at_all(target) as temporary:
        WRITERS[target.suffix](log, temporary)


def _channels(log: RobotLog) -> dict[str, NDArray[np.generic]]:
    """List the written channels: of a commanded log the commands, not the torques that follow from them."""
    computed = () if log.command is None else ("torque", "command", "feedback")
    return {name: values for name, values in log.channels().items() if name not in computed}


def _write_npz(log: RobotLog, path: Path) -> None:
    names = {"joint_names": np.array(log.joint_names), "torque_source": np.array(log.torque_source)}
    names |= {"foot_names": np.array(log.foot_names)} if log.foot_names else {}
    with path.open("wb") as file:
        np.savez(file, allow_pickle=False, **names, **_channels(log))


def _write_parquet(log: RobotLog, path: Path) -> None:
    table = pa.table({name: np.ascontiguousarray(values) for name, values in named_columns(log).items()})
    pyarrow.parquet.write_table(table, path, row_group_size=BLOCK_ROWS, write_page_checksum=True)


def named_columns(log: RobotLog) -> dict[str, NDArray[np.generic]]:
    """Split the channels of a log into columns, shape (T,), named as in a log in Parquet or CSV."""
    columns: dict[str, NDArray[np.generic]] = {}
    for channel, values in _channels(log).items():
        columns |= dict(zip(column_names(log, channel), values.reshape(len(values), -1).T, strict=True))
    return columns


WRITERS: dict[str, Callable[[RobotLog, Path], None]] = {".npz": _write_npz, ".parquet": _write_parquet}
"""Writers by suffix."""
