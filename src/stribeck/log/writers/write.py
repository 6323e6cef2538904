"""From a RobotLog to a file."""

from collections.abc import Callable
from pathlib import Path

from stribeck.errors import LogError
from stribeck.log.robot_log import RobotLog
from stribeck.log.writers.mcap import write_mcap
from stribeck.log.writers.npz import write_npz
from stribeck.log.writers.parquet import write_parquet
from stribeck.outputs import whole_or_not_at_all

WRITERS: dict[str, Callable[[RobotLog, Path], list[str]]] = {
    ".npz": write_npz,
    ".parquet": write_parquet,
    ".mcap": write_mcap,
}
"""Writers by suffix, which return the channels that the format has no place for."""


def write_log(log: RobotLog, path: str | Path) -> list[str]:
    """Write a log, in SI units and under the names that `read_log` reads without any setting, whole or not at all.

    Parameters
    ----------
    log
        Its time may be irregular and values may be missing (NaN); both are written as they are.
    path
        A `.npz`, `.parquet` or `.mcap` file; one that is there is written over.

    Returns
    -------
    left_out
        Channels that the format has no place for: in messages, accelerations, temperatures and external
        torques.

    Raises
    ------
    LogError
        If there is no writer for the suffix, a message would need what the log lacks, or torques are currents.
    SettingsError
        If the file cannot be written.

    Examples
    --------
    >>> write_log(read_log("log.npz"), "log.parquet")
    []
    >>> write_log(read_log("log.npz"), "log.mcap")
    ['acceleration']
    """
    target = Path(path)
    if target.suffix not in WRITERS:
        raise LogError(f"{target}: the suffix is '{target.suffix}'; logs are written as {', '.join(WRITERS)}")
    if log.in_amperes:
        raise LogError(
            f"{log.path or 'log'}: torques of {', '.join(log.in_amperes)} are currents in amperes, and logs are "
            "written in N m; expected their [robot.motors.<joint>] torque_constant"
        )
    with whole_or_not_at_all(target) as temporary:
        return WRITERS[target.suffix](log, temporary)
