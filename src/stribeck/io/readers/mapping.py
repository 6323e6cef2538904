"""Application of the `[log]` tables: names, units, signs, orders, delays and other clocks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.core.errors import LogError, SettingsError, listed
from stribeck.core.log.channels import ANGLE, CHANNELS, SPEED, TURN, VECTOR_CHANNELS
from stribeck.core.log.clock import TIME, longest_step, refuse_wrong_time
from stribeck.core.log.interpolation import bridges, linear, previous, slerp
from stribeck.core.settings import ChannelTable, LogTable, PerJoint

if TYPE_CHECKING:
    from stribeck.core.robot import Robot  # Pinocchio is slow to import

EFFORT = {"Nm": 1.0, "N m": 1.0, "mNm": 1e-3, "kNm": 1e3, "N": 1.0, "mN": 1e-3, "kN": 1e3}
CURRENT = {"A": 1.0, "mA": 1e-3}
UNITS: dict[str, dict[str, float]] = {
    "time": TIME,
    **dict.fromkeys(("position", "desired_position"), ANGLE),
    **dict.fromkeys(("velocity", "desired_velocity"), SPEED),
    "acceleration": {"rad/s^2": 1.0, "deg/s^2": TURN / 360, "m/s^2": 1.0, "mm/s^2": 1e-3},
    "torque": EFFORT | CURRENT,
    **dict.fromkeys(("desired_torque", "external_torque", "foot_wrench"), EFFORT),
    "temperature": {"degC": 1.0},
    "base_orientation": {},
    "contact": {},
    "angular_velocity": {unit: SPEED[unit] for unit in ("rad/s", "deg/s", "rpm")},
    "linear_acceleration": {"m/s^2": 1.0, "g": 9.80665},  # standard gravity
    "foot_force": {unit: EFFORT[unit] for unit in ("N", "mN", "kN")},
}
"""Units of each channel in a log, with factors to SI."""
ALIASES = {
    "time": ("t", "timestamp", "timestamps", "stamp", "stamps"),
    "position": ("q", "positions", "joint_position", "joint_positions", "joint_pos"),
    "velocity": ("qd", "dq", "qdot", "velocities", "joint_velocity", "joint_velocities", "joint_vel"),
    "acceleration": ("qdd", "ddq", "qddot", "accelerations", "joint_acceleration", "joint_accelerations"),
    "torque": ("tau", "effort", "efforts", "torques", "joint_torque", "joint_torques", "joint_effort", "joint_efforts"),
}
"""Channel -> its other names. Quaternions and IMU signals have none, because names do not define their order and frame.
"""


def asked_names(table: LogTable, channel: str) -> list[str]:
    """List the names that `[log]` gives to a channel."""
    name = getattr(table, channel).name or []
    return [name] if isinstance(name, str) else name


def find_aliases(table: LogTable, offers: Mapping[str, int]) -> dict[str, str]:
    """Find the alternative names of channels in a log: {channel: name}.

    A name counts if it is the only alternative, and neither the channel's standard name nor a setting locates the
    channel. Optional channels must also have as many columns as the position.

    Parameters
    ----------
    offers
        {name in the log: its number of columns}.
    """
    aliases: dict[str, str] = {}
    for channel, names in ALIASES.items():
        matches = [name for name in names if name in offers]
        if channel in offers or getattr(table, channel).name is not None or len(matches) != 1:
            continue
        positions = offers.get(aliases.get("position", "position"))
        if channel in ("time", "position", "torque") or offers[matches[0]] == positions:
            aliases[channel] = matches[0]
    return aliases


def alias_note(aliases: Mapping[str, str]) -> list[str]:
    """Note the alternative names that are used."""
    pairs = ", ".join(f"'{name}' as {channel}" for channel, name in aliases.items())
    return [f"Alternative names in the log: {pairs}."] if aliases else []


def check_table(table: LogTable, where: str) -> None:
    """Refuse settings of `[log]` that are not valid for their channel.

    Raises
    ------
    SettingsError
        Names the file, the key, and the valid choices.
    """
    # Channels whose jumps can be removed: by whole turns, or by the range of unsigned integers.
    unwrapped = ("position", "velocity", "torque")
    for name in CHANNELS:
        settings: ChannelTable = getattr(table, name)
        if settings.unit is not None and settings.unit not in UNITS[name]:
            raise SettingsError(
                f"{where}: [log.{name}] unit is '{settings.unit}'; expected {listed(list(UNITS[name]), 10)}"
            )
        if settings.unwrap and name not in unwrapped:
            raise SettingsError(f"{where}: [log.{name}] unwrap is set; only {listed(unwrapped)} can be unwrapped")
        for key, known in (("order", ("base_orientation",)), ("mount", (*VECTOR_CHANNELS,))):
            if getattr(settings, key) is not None and name not in known:
                raise SettingsError(f"{where}: [log.{name}] {key} is set; only {listed(known)} can have it")
        by_joint = any(isinstance(value, list | dict) for value in (settings.scale, settings.offset))
        if name == "time" and (settings.delay or by_joint):
            what = "a delay, or a scale or offset by joint"
            raise SettingsError(f"{where}: [log.time] has {what}; give one number, and each channel its own delay")


def seconds(stamps: NDArray[np.generic], settings: ChannelTable, unit: str | None) -> tuple[Array, list[str]]:
    """Convert stamps in the log's unit to time [s], shape (T,); large stamps are counted from the first one."""
    factor = TIME[unit or settings.unit or "s"] * float(np.asarray(settings.scale))
    offset = float(np.asarray(settings.offset))
    values = stamps.reshape(-1)
    if not values.size:
        return np.zeros(0), []
    first = values[0] if values.dtype.kind in "iu" else np.float64(next(iter(values[np.isfinite(values)]), 0.0))
    if abs(float(first) * factor) < 1e8:  # [s]; stamps since 1970 would lose microseconds in float64
        time = values.astype(np.float64, copy=False)
        return (time if factor == 1 and offset == 0 else time * factor + offset), []
    exact = np.int64 if values.dtype.kind in "iu" else np.float64
    since = values.astype(exact) - exact(first)
    note = f"Time counts from the log's first stamp, {float(first) * factor:.6f} s."
    return since.astype(np.float64) * factor + offset, [note]


def convert(
    channel: str, values: Array, labels: Sequence[str], columns: Sequence[int], settings: ChannelTable, where: str
) -> None:
    """Convert a loaded channel to SI units, signs and orders, in place.

    Parameters
    ----------
    values
        Loaded values, shape (T, k).
    labels
        The log's names of all columns of this channel, used by settings.
    columns
        Column numbers of `values`, shape (k,).
    """
    if settings.unwrap and channel != "position":
        size = 2.0**16 if np.nanmax(values, initial=0.0) < 2**16 else 2.0**32
        values -= size * (values >= size / 2)
    unit = UNITS[channel][settings.unit] if settings.unit else 1.0
    factor = unit * _expand(settings.scale, 1.0, channel, "scale", labels, where)[list(columns)]
    offset = _expand(settings.offset, 0.0, channel, "offset", labels, where)[list(columns)]
    if np.any(factor != 1):
        values *= factor
    if np.any(offset != 0):
        values += offset
    if settings.order == "wxyz":
        values[:] = values[:, [1, 2, 3, 0]]
    if settings.mount is not None:
        _into_base(values, settings.mount)
    if settings.unwrap and channel == "position":
        for column in values.T:
            known = np.isfinite(column)
            column[known] = np.unwrap(column[known])


def _into_base(values: Array, angles: Sequence[float]) -> None:
    """Convert vectors, shape (T, 3), or orientations, (T, 4), of an IMU to those of the base, in place."""
    from scipy.spatial.transform import Rotation

    mount, known = Rotation.from_euler("xyz", angles), np.isfinite(values).all(axis=1)
    if known.any():
        part = values[known]
        values[known] = mount.apply(part) if part.shape[1] == 3 else (Rotation.from_quat(part) * mount.inv()).as_quat()


def into_limits(position: Array, robot: Robot) -> None:
    """Move unwrapped positions, shape (T, n), by whole turns if they then are within the model's limits, in place."""
    low, high = np.array(robot.position_limits)
    for column in np.flatnonzero(np.isfinite(low + high) & ~np.array(robot.prismatic)):
        known = position[np.isfinite(position[:, column]), column]
        least, most = (known.min(), known.max()) if known.size else (np.inf, -np.inf)
        if most <= high[column] + 0.1 and least >= low[column] - 0.1:
            continue
        shift = 2 * np.pi * np.round((least + most - low[column] - high[column]) / (4 * np.pi))
        if most - shift <= high[column] + 0.1 and least - shift >= low[column] - 0.1:
            position[:, column] -= shift


def word_size(values: Array) -> float:
    """Find the number that was added to negative values by storing signed integers as unsigned: 2^16, 2^32, or 0."""
    finite = values[np.isfinite(values) & ~np.any(values < 0)]  # a long log, which has both signs, is not copied
    if not finite.size or np.any(finite != np.round(finite)):
        return 0.0
    size = 2.0**16 if finite.max() < 2**16 else 2.0**32
    middle = (finite > size / 4) & (finite < 3 * size / 4)  # no signal uses all of the range, back and forth
    return size * (3 * size / 4 <= finite.max() < size and finite.min() < size / 4 and not middle.any())


def _expand(setting: PerJoint, default: float, channel: str, key: str, labels: Sequence[str], where: str) -> Array:
    """Expand a setting to one value per column; one more at the end is for column -1, which the log lacks."""
    place = f"{where}: [log.{channel}] {key}"
    if isinstance(setting, dict):
        if unknown := [name for name in setting if name not in labels]:
            raise SettingsError(f"{place} names {listed(unknown)}; the log's columns are {listed(labels, 40)}")
        return np.array([setting.get(name, default) for name in labels] + [default])
    if isinstance(setting, list):
        if len(setting) != len(labels):
            raise SettingsError(f"{place} lists {len(setting)} values; expected {len(labels)}, one per column")
        return np.array([*setting, default])
    return np.array([setting] * len(labels) + [default])


def advance(channels: dict[str, Array], time: Array, table: LogTable, path: str) -> tuple[slice, list[str]]:
    """Remove delays in place: the value of a delayed channel at t is the log's value at t + delay.

    Values between samples farther apart than `longest_step` become NaN, because they are unknown.

    Returns
    -------
    slice, notes
        Rows in which all delayed channels are known, and notes.
    """
    delays = {name: delay for name in channels if (delay := getattr(table, name).delay) != 0}
    if not delays:
        return slice(None), []
    refuse_wrong_time(time, path)
    known = np.isfinite(time)
    clock = time[known]
    if len(clock) < 2:
        raise LogError(f"{path}: has {len(clock)} samples; a delay needs at least two")
    longest = longest_step(float(np.median(np.diff(clock))), table.max_gap)
    for name, delay in delays.items():
        channels[name] = resample(name, time + delay, clock, channels[name][known], longest)
    start, stop = clock[0] - min(0.0, *delays.values()), clock[-1] - max(0.0, *delays.values())
    rows = np.flatnonzero(known & (time >= start) & (time <= stop))
    if not rows.size:
        raise LogError(f"{path}: is {clock[-1] - clock[0]:.6g} s long, shorter than the delays {delays} of [log]")
    text = ", ".join(f"{name} by {1e3 * delay:g} ms" for name, delay in delays.items())
    return slice(int(rows[0]), int(rows[-1]) + 1), [f"Delays removed by interpolation: {text}."]


def resample(channel: str, query: Array, time: Array, values: Array, longest: float, *, held: bool = False) -> Array:
    """Interpolate samples, shape (N, k), at other times, shape (T,); NaN between samples farther apart than `longest`.

    Flags, and any channel that is `held`, keep the last value instead.
    """
    held = held or channel == "contact"
    between = previous if held else slerp if channel == "base_orientation" else linear
    result = np.asarray(between(query, time, values), dtype=np.float64)
    if not held:
        result[bridges(query, time, longest)] = np.nan
    return result
