"""Reading of a file into a RobotLog."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import numpy as np

from stribeck.core.base.typing import Array, BoolArray, TorqueSource
from stribeck.core.errors import LogError, SettingsError, errors_about, listed
from stribeck.core.log import RobotLog
from stribeck.core.log.storage import allocate
from stribeck.core.settings import LogTable
from stribeck.io.readers.actuators import check_current, commanded_torques, through_motors
from stribeck.io.readers.columns import source_of_columns
from stribeck.io.readers.formats import choose_opener
from stribeck.io.readers.mapping import advance, check_table, convert, into_limits, seconds, word_size
from stribeck.io.readers.recording import Arrays, Recording, foreign
from stribeck.io.readers.selection import MOTION, Selection, select
from stribeck.io.readers.tables import open_csv, table_of_frame
from stribeck.io.readers.unitree import name_motors

if TYPE_CHECKING:
    from stribeck.core.robot import Robot


@np.errstate(over="ignore", invalid="ignore")  # damaged numbers may overflow; `regularise` removes such rows
def read_log(path: str | Path, robot: Robot | str | Path | None = None) -> RobotLog:
    """Read a log.

    Parameters
    ----------
    path
        A file of arrays, of a table, of records or of messages, by its suffix; or the folder of a rosbag2, of a LeRobot
        dataset or of tables.
    robot
        Robot, or the path of its robot file, whose joint order and `[log]` settings are applied. If None, all joints of
        the log are read.

    Returns
    -------
    RobotLog
        Log in SI units; its `notes` describe changes to the data and ignored parts. Time may still be irregular, and
        values missing (NaN), until `stribeck.core.log.sampling.regularise`.

    Raises
    ------
    LogError
        If the file cannot be read, or lacks joints of the robot.
    SettingsError
        If a setting of `[log]` is not valid for its channel.
    RobotFileError
        If the robot file cannot be used.

    Examples
    --------
    >>> log = read_log("log.npz", robot)
    >>> log
    RobotLog(12000 samples in 12 s of log.npz, 3 joints: shoulder, elbow, slide; position, torque, velocity, ...)
    >>> log.torque.shape
    (12000, 3)
    """
    if isinstance(robot, str | Path):
        from stribeck.core.robot import Robot  # Pinocchio is slow to import

        robot = Robot.from_file(robot)
    path = Path(path)
    opener = choose_opener(path)
    table, where = _check_settings(robot, csv=opener is open_csv)
    return _read(opener(path, table), robot, table, where, str(path))


def read_recording(source: Recording, robot: Robot) -> RobotLog:
    """Read an opened log, as `read_log` does, if the names of the channels in `[log]` are those it was opened with."""
    return _read(source, robot, *_check_settings(robot, csv=True), source.path)


def read_stream(path: Path, robot: Robot, seconds: float) -> Iterator[RobotLog]:
    """Read an MCAP file as it grows, or standard input for "-", in parts of some seconds; time continues.

    Raises
    ------
    LogError, SettingsError
        As for `read_log`.
    """
    from stribeck.io.readers import bags

    table, where = _check_settings(robot, csv=False)
    for source in bags.open_parts(path, table, seconds):
        yield _read(source, robot, table, where, source.path)


@np.errstate(over="ignore", invalid="ignore")
def read_frame(frame: object, robot: Robot | None = None) -> RobotLog:
    """Read a log from a table in memory: `RobotLog.from_frame`."""
    table, where = _check_settings(robot, csv=False)
    return _read(source_of_columns(table_of_frame(frame), table), robot, table, where, "")


def _check_settings(robot: Robot | None, *, csv: bool) -> tuple[LogTable, str]:
    """Check the settings of `[log]`, and return them with the path of their file."""
    table, where = robot.log_table if robot else LogTable(), (robot.path if robot else "") or "robot file"
    check_table(table, where)
    if robot:
        check_current(robot)
    if table.columns and not csv:
        raise SettingsError(f"{where}: [log] columns is set; only CSV files without a line of names have use for it")
    return table, where


def _read(source: Recording, robot: Robot | None, table: LogTable, where: str, path: str) -> RobotLog:
    """Read a recording in the robot's joint order and in SI units."""
    source, motor_notes = name_motors(source, table, robot.joint_names if robot else ())
    selection = select(source, table, robot)
    with errors_about(source.path), foreign(source.path, "a log"):
        wanted = {name: columns for name, columns in selection.columns.items() if name in source.channels}
        loaded, load_notes = source.load(wanted)
    time, time_notes = _read_time(source, loaded, table)
    channels = _collect_channels(source, selection, loaded, len(time), table)
    for name, values in channels.items():
        labels = selection.labels.get(name, selection.joint_names)
        convert(name, values, labels, selection.columns[name], getattr(table, name), where)
    if robot and table.position.unwrap:
        into_limits(channels["position"], robot)
    notes = [*motor_notes, *selection.notes, *load_notes, *time_notes, *_fill(channels, selection, robot)]
    rows, delay_notes = advance(channels, time, table, source.path)
    time, channels = time[rows], {name: values[rows] for name, values in channels.items()}
    drives, drive_notes = dict[str, Any](), list[str]()
    if robot and "torque" not in channels:
        drives, drive_notes = commanded_torques(channels, time, robot)
    elif robot:
        drives = {"unscaled": dict.fromkeys(through_motors(channels["torque"], robot), 1.0)}
    contact, contact_notes = _read_flags(channels.pop("contact", None), source.path)
    torque_source, torque_notes = _find_torque_source(source, robot)
    shape = (-1, len(selection.foot_names), 6)
    wrench = channels.pop("foot_wrench").reshape(shape) if "foot_wrench" in channels else None
    return RobotLog(
        time=time,
        joint_names=selection.joint_names,
        foot_names=selection.foot_names,
        contact=contact,
        foot_wrench=wrench,
        **channels,  # type: ignore[arg-type]
        **drives,
        torque_source=torque_source,
        notes=(*notes, *delay_notes, *drive_notes, *contact_notes, *torque_notes),
        path=path,
        raw=robot is None,
    )


def _read_time(source: Recording, loaded: Arrays, table: LogTable) -> tuple[Array, list[str]]:
    """Compute time [s] from the log's stamps, or from `[log] rate`."""
    if "time" in loaded:
        if loaded["time"].shape[1] != 1:
            raise LogError(f"{source.path}: 'time' has {loaded['time'].shape[1]} columns; expected one")
        time, notes = seconds(loaded.pop("time"), table.time, source.time_unit)
    elif table.rate is not None:
        time = np.arange(len(loaded["position"])) / table.rate
        unread = "; the log's time is not read" * ("time" in source.channels)
        notes = [f"Stamps were computed from [log] rate = {table.rate:g} Hz{unread}."]
    else:
        raise LogError(
            f"{source.path}: contains no time; expected 'time', another name as [log.time] name, or [log] rate in Hz "
            f"(found {listed([*source.channels, *source.others])})"
        )
    if len(time) < 2:
        raise LogError(f"{source.path}: has {len(time)} samples; expected at least two")
    return time, notes


def _collect_channels(
    source: Recording, selection: Selection, loaded: Arrays, samples: int, table: LogTable
) -> dict[str, Array]:
    """Check length and signs of loaded channels; a missing channel that is required becomes zero."""
    channels = {}
    for name, columns in selection.columns.items():
        if name == "time":
            continue
        values = np.asarray(loaded.pop(name) if name in loaded else allocate((samples, len(columns))), dtype=np.float64)
        if len(values) != samples:
            raise LogError(f"{source.path}: '{name}' has {len(values)} rows, 'time' has {samples}; expected as many")
        if name in ("velocity", "torque") and not getattr(table, name).unwrap and (size := word_size(values)):
            raise LogError(
                f"{source.path}: '{name}' is either small or near {size:g}: negative integers were stored as unsigned "
                f"ones; set [log.{name}] unwrap = true"
            )
        channels[name] = values
    return channels


def _fill(channels: dict[str, Array], selection: Selection, robot: Robot | None) -> list[str]:
    """Fill missing temperatures with NaN, and missing torques of position-controlled joints with zero."""
    if "temperature" in channels:
        channels["temperature"][:, [column < 0 for column in selection.columns["temperature"]]] = np.nan
    for name in MOTION if robot and robot.passive else ():
        if name in channels:  # passive joints follow the others
            channels[name][:, [column < 0 for column in selection.columns[name]]] = np.nan
    joints_by_rows: dict[int, list[str]] = {}
    for joint in robot.position_controlled if robot and "torque" in channels else ():
        torque = channels["torque"][:, selection.joint_names.index(joint)]
        unknown = ~np.isfinite(torque)
        if unknown.any():
            torque[unknown] = 0.0
            joints_by_rows.setdefault(int(unknown.sum()), []).append(joint)
    return [
        f"Torque of position-controlled {listed(joints)} is missing in {rows} rows and was set to zero."
        for rows, joints in joints_by_rows.items()
    ]


def _read_flags(contact: Array | None, path: str) -> tuple[BoolArray | None, list[str]]:
    """Convert contact flags to booleans; a missing flag keeps the previous value."""
    if contact is None:
        return None, []
    unknown = ~np.isfinite(contact)
    notes = []
    if unknown.any():
        notes.append(f"{unknown.sum()} missing contact flags keep the previous value.")
        rows = np.where(unknown, 0, np.arange(len(contact))[:, None])
        contact = np.nan_to_num(np.take_along_axis(contact, np.maximum.accumulate(rows, axis=0), axis=0))
    strange = contact[(contact != 0) & (contact != 1)]
    if strange.size:
        raise LogError(
            f"{path}: 'contact' contains {strange[0]:g}; expected flags, 0 or 1 (forces belong in 'foot_wrench' or "
            "'foot_force')"
        )
    return contact > 0.5, notes


def _find_torque_source(source: Recording, robot: Robot | None) -> tuple[TorqueSource, list[str]]:
    """Determine the torque source from the robot file, or else from the log."""
    valid: tuple[TorqueSource, ...] = get_args(TorqueSource)
    said = source.torque_source
    if said is not None and said not in valid:
        raise LogError(f"{source.path}: 'torque_source' is '{said}'; expected one of {listed(valid)}")
    of_log = next((option for option in valid if option == said), valid[0])
    if robot is None:
        return of_log, []
    if said is not None and of_log != robot.torque_source:
        return robot.torque_source, [
            f"The log has torque_source '{of_log}', the robot file '{robot.torque_source}'; the robot file is used."
        ]
    return robot.torque_source, []
