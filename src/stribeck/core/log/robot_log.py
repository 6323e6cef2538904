"""`RobotLog`: recorded signals in SI units, in the robot's joint order."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from stribeck.core.base.frame import Frame, data_frame
from stribeck.core.base.parts import SERVICES
from stribeck.core.base.spans import Span, listed_spans
from stribeck.core.base.text_table import TextTable, span
from stribeck.core.base.typing import Array, BoolArray, IntArray, TorqueSource
from stribeck.core.errors import LogError

if TYPE_CHECKING:
    import pandas

    from stribeck.core.robot import Robot


@dataclass(frozen=True, eq=False, kw_only=True)
class RobotLog:
    """Log of T samples of n joints, in SI units and radians. Optional channels may be None.

    Attributes
    ----------
    time
        Time [s], shape (T,), strictly increasing.
    joint_names
        Names of the n joints, in the order of the columns.
    position, torque
        Positions [rad] or [m] and torques [N m] or [N], shape (T, n).
    velocity, acceleration
        Recorded velocities and accelerations, shape (T, n).
    base_orientation
        Unit quaternion xyzw from base to world, shape (T, 4).
    angular_velocity, linear_acceleration
        IMU signals in the frame of the IMU, [rad/s] and [m/s^2], shape (T, 3).
    foot_names
        Names of the columns of `contact`, `foot_wrench` and `foot_force`.
    contact
        Whether a foot stands, shape (T, feet), bool.
    foot_wrench
        Force [N] and moment [N m] of the ground on the foot, in the contact frame, shape (T, feet, 6).
    foot_force
        Vertical force of the ground on the foot [N] from sensors with a single axis, shape (T, feet).
    temperature
        Temperature [°C], shape (T, n).
    external_torque
        External joint torques [N m] or [N], e.g. from a load motor, positive in the direction of increasing position,
        shape (T, n).
    torque_source
        Source of the torque.
    desired_position, desired_velocity, desired_torque
        Commands as logged [rad], [rad/s], [N m], shape (T, n); not used beyond `command`.
    command, feedback
        Parts of a commanded torque [N m], shape (T, n): the part of the command, which acts late, and that of measured
        positions and velocities, which acts at once. None where torques are measured.
    effort_limits
        Largest commanded torque of each joint [N m]; empty where torques are measured.
    command_delays
        Time from the stamp of each joint's command until it acts, and its standard error [s]; empty until it is found.
    unscaled
        Joints whose torque is a current [A] or a deflection of the command [rad], [m], because torque constant or kp is
        unknown, and the rough factor by which it is multiplied (1 until it is estimated).
    notes
        Changes that the reader made to the data, one sentence each.
    path
        Path of the file; empty for a log made in memory.
    raw
        Whether the log was read without a robot, and therefore without its `[log]` settings.
    start
        Stamp from which spans of the log are counted [s]: the first stamp of the whole log.
    excluded
        Spans that `excluding` removed [s].

    Raises
    ------
    LogError
        If a channel is not an array of numbers, or the shapes do not agree.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.arange(0.0, 1.0, 0.01)
    >>> sine = np.sin(time)[:, None]
    >>> RobotLog(time=time, joint_names=("elbow",), position=sine, torque=-9.81 * sine)
    RobotLog(100 samples in 0.99 s, 1 joint: elbow; position, torque)
    """

    time: Array
    joint_names: tuple[str, ...]
    position: Array
    torque: Array
    velocity: Array | None = None
    acceleration: Array | None = None
    base_orientation: Array | None = None
    angular_velocity: Array | None = None
    linear_acceleration: Array | None = None
    foot_names: tuple[str, ...] = ()
    contact: BoolArray | None = None
    foot_wrench: Array | None = None
    foot_force: Array | None = None
    temperature: Array | None = None
    external_torque: Array | None = None
    desired_position: Array | None = None
    desired_velocity: Array | None = None
    desired_torque: Array | None = None
    command: Array | None = None
    feedback: Array | None = None
    effort_limits: tuple[float, ...] = ()
    command_delays: tuple[tuple[float, float], ...] = ()
    torque_source: TorqueSource = "link_side_sensor"
    unscaled: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    path: str = ""
    raw: bool = False
    start: float = math.nan
    excluded: tuple[Span, ...] = ()

    def __post_init__(self) -> None:
        """Convert lists to arrays, and refuse channels whose shapes do not agree."""
        object.__setattr__(self, "joint_names", tuple(self.joint_names))
        object.__setattr__(self, "foot_names", tuple(self.foot_names))
        samples, joints, feet = len(self.time), len(self.joint_names), len(self.foot_names)
        of_joints = ("position", "torque", "velocity", "acceleration", "temperature", "external_torque")
        of_commands = ("desired_position", "desired_velocity", "desired_torque", "command", "feedback")
        shapes = {
            "time": (samples,),
            **dict.fromkeys((*of_joints, *of_commands), (samples, joints)),
            "base_orientation": (samples, 4),
            "angular_velocity": (samples, 3),
            "linear_acceleration": (samples, 3),
            "contact": (samples, feet),
            "foot_wrench": (samples, feet, 6),
            "foot_force": (samples, feet),
        }
        for name, shape in shapes.items():
            channel = getattr(self, name)
            if channel is not None and not isinstance(channel, np.ndarray):
                try:
                    channel = np.asarray(channel, dtype=bool if name == "contact" else float)
                except (TypeError, ValueError) as error:
                    raise LogError(f"{self.path or 'log'}: channel '{name}' is not an array of numbers") from error
                object.__setattr__(self, name, channel)
            if channel is not None and channel.shape != shape:
                raise LogError(
                    f"{self.path or 'log'}: channel '{name}' has shape {channel.shape}, "
                    f"expected {shape} ({samples} samples, {joints} joints, {feet} feet)"
                )
        stamps = self.time[np.isfinite(self.time)]
        if math.isnan(self.start) and len(stamps):
            object.__setattr__(self, "start", float(stamps[0]))

    def __repr__(self) -> str:
        seconds = float(self.time[-1] - self.time[0]) if len(self.time) else 0.0
        names = ", ".join([*self.joint_names[:3], *["..."] * (len(self.joint_names) > 3)])
        joints = f"{len(self.joint_names)} joint{'s' * (len(self.joint_names) != 1)}"
        held = ", ".join(name for name in self.channels() if name != "time")
        place = f" of {self.path}" * bool(self.path)
        return f"RobotLog({len(self.time)} samples in {seconds:.4g} s{place}, {joints}: {names}; {held})"

    def _repr_html_(self) -> str:
        """Format one row per channel as an HTML table for notebooks."""
        rows = [
            [name, " x ".join(map(str, array.shape)), span((np.nanmin(array), np.nanmax(array))) if array.size else ""]
            for name, array in self.channels().items()
        ]
        return TextTable(title=repr(self), left=["channel"], right=["shape", "range"], rows=rows).html()

    def applied_torque(self, rows: slice = slice(None)) -> Array:
        """Sum measured and external torques."""
        torque = self.torque[rows]
        return torque if self.external_torque is None else torque + self.external_torque[rows]

    def channel_unit(self, prismatic: bool) -> str:
        """Return the unit of a current or of the deflection of a command, for joints in `unscaled`."""
        return "A" if self.torque_source == "motor_current" else "m" if prismatic else "rad"

    @staticmethod
    def from_frame(frame: object, robot: Robot | None = None) -> RobotLog:
        """Read a log from a table in memory.

        Parameters
        ----------
        frame
            Frame of pandas, polars or another library with the Arrow interface (`__arrow_c_stream__`). Its columns are
            named as in a log in Parquet or CSV; a named index counts as a column.
        robot
            Robot whose joint order and `[log]` settings are applied. If None, all joints of the log are read.

        Raises
        ------
        LogError
            If it is no frame, or lacks joints of the robot.
        SettingsError
            If a setting of `[log]` is not valid for its channel.

        Examples
        --------
        >>> import pandas
        >>> names = [f"{channel}.{joint}" for channel in ("position", "torque") for joint in log.joint_names]
        >>> values = np.hstack([log.position, log.torque])
        >>> frame = pandas.DataFrame(values, columns=names, index=pandas.Index(log.time, name="time"))
        >>> RobotLog.from_frame(frame, robot)
        RobotLog(12000 samples in 12 s, 3 joints: shoulder, elbow, slide; position, torque)
        """
        return cast(RobotLog, SERVICES["read_frame"](frame, robot))

    def to_frame(self) -> pandas.DataFrame:
        """Convert to a pandas table that `from_frame` reads: a column `time`, then one per signal.

        Raises
        ------
        SettingsError
            If pandas is not installed.

        Examples
        --------
        >>> log.to_frame().columns[:2].to_list()
        ['time', 'position.shoulder']
        """
        return data_frame("to_frame", SERVICES["frame_columns"](self))

    def channels(self) -> dict[str, NDArray[np.generic]]:
        """Return the sampled channels of this log by name; the first axis of each is time."""
        arrays = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: array for name, array in arrays.items() if isinstance(array, np.ndarray)}

    def between(self, start: float | None = None, stop: float | None = None) -> RobotLog:
        """Cut out the time from `start` to `stop` [s] after the start of the log; None is its start or end.

        Raises
        ------
        LogError
            If fewer than two samples remain.

        Examples
        --------
        >>> log.between(2.0, 10.0)
        RobotLog(8001 samples in 8 s, 3 joints: shoulder, elbow, slide; position, torque, ...)
        """
        since = self.time - self.start
        lasts = float(np.max(since[np.isfinite(since)], initial=0.0))
        low, high = 0.0 if start is None else start, lasts if stop is None else stop
        kept = (since >= low) & (since <= high)
        if np.count_nonzero(kept) < 2:
            problem = f"the part from {low:g} s to {high:g} s has fewer than 2 samples"
            if low >= lasts:
                problem = f"the start of the part, {low:g} s, is after the end of the log ({lasts:.3g} s)"
            raise LogError(f"{self.path or 'log'}: {problem}")
        note = f"Only {low:g} s to {high:g} s of the log's {lasts:.6g} s are used."
        return replace(self.take(kept), notes=(*self.notes, note))

    def excluding(self, spans: Sequence[Span]) -> RobotLog:
        """Remove spans, given by start and end [s] after the start of the log.

        Raises
        ------
        LogError
            If fewer than two samples remain.

        Examples
        --------
        >>> log.excluding([Span(2.0, 3.0), Span(5.0, 5.5)])
        RobotLog(10500 samples in 12 s, 3 joints: shoulder, elbow, slide; position, torque, ...)
        """
        since = self.time - self.start
        inside = [(since >= low) & (since < high) for low, high, _ in spans]
        kept = ~np.any(inside, axis=0)
        if np.count_nonzero(kept) < 2:
            raise LogError(f"{self.path or 'log'}: fewer than 2 samples remain after excluding {listed_spans(spans)}")
        notes = [
            f"{listed_spans([span])} of the log is excluded{'' if rows.any() else ', but has no samples'}."
            for span, rows in zip(spans, inside, strict=True)
        ]
        return replace(self.take(kept), notes=(*self.notes, *notes), excluded=(*self.excluded, *spans))

    def take(self, rows: slice | IntArray | BoolArray) -> RobotLog:
        """Select rows."""
        return replace(self, **{name: array[rows] for name, array in self.channels().items()})  # type: ignore[arg-type]


LogLike = RobotLog | Frame | str | Path
"""Log, frame, or path of a log."""
