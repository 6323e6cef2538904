"""Channels of a log with other names and units than the standard ones."""

import re
from typing import Any

import numpy as np

from stribeck.base.typing import Array, TorqueSource
from stribeck.log import RobotLog
from stribeck.log.clock import RATES
from stribeck.log.plausibility import position_slopes, units_of_slope
from stribeck.log.readers.channels import JOINT_CHANNELS
from stribeck.log.readers.recording import Recording
from stribeck.robot import Robot

WORDS: dict[str, set[str]] = {
    "time": {"time", "t", "timestamp", "timestamps", "stamp", "stamps", "sec", "secs", "seconds", "clock", "zeit"},
    "position": {"position", "positions", "pos", "q", "qpos", "angle", "angles", "theta", "jpos", "encoders"},
    "torque": {"torque", "torques", "tau", "effort", "efforts", "eff", "moment", "moments"},
    "velocity": {"velocity", "velocities", "vel", "dq", "qd", "qvel", "speed", "omega", "jvel"},
    "base_orientation": {"orientation", "quat", "quaternion", "attitude"},
    "contact": {"contact", "contacts"},
}
"""Words in the names of each channel."""
CURRENTS = {"current", "currents", "cur", "curr", "amps", "ampere", "amperes", "i"}
"""Words for motor currents, which replace torques that were not measured."""
TURNS = ("turn", "turns", "rev", "revs", "revolution", "revolutions", "rotations")
"""Words for turns."""
UNITS: dict[str, dict[str, str]] = {
    "position": {"rad": "rad", **dict.fromkeys(("deg", "degree", "degrees"), "deg"), **dict.fromkeys(TURNS, "turn")},
    "torque": {"mnm": "mNm", "nm": "Nm"},
    "velocity": {"rpm": "rpm", "krpm": "krpm", "rps": "turn/s"},
    "current": {"ma": "mA", "a": "A"},
}
"""Words that are units -> their names in a robot file."""
TIMES = {"s", "sec", "ms", "us", "ns"}
"""Units of time, which are detected from the steps."""
MEASURED = {"meas", "measured", "msr", "actual", "act", "state", "raw", "joint", "joints", "dof", "est", "estimated"}
MEASURED |= {"estimate", "estimates", "feedback", "present", "ist"}
"""Words for measured signals, which are preferred."""
OTHERS = {"error", "fric", "friction", "model", "limit", "filt", "dot", "ext", "external", "gravity", "coriolis"}
"""Words for signals that were not measured."""
COMMANDS = {"cmd", "command", "commanded", "con", "control", "ctrl", "target", "des", "desired", "ref", "reference"}
COMMANDS |= {"soll", "d"}
"""Words for commands: a commanded torque is used if there is no other torque and no current."""


def words(name: str) -> list[str]:
    """Split a name into lower-case words, without numbers."""
    return [part.lower() for part in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", name)]


def find_columns(source: Recording) -> tuple[dict[str, dict[str, Any]], TorqueSource | None]:
    """Find `[log.<channel>]` for channels with other names, and the source of the torque if names suggest it.

    Of several candidates for a channel, the one with the fewest contradicting words is used.
    """
    groups: dict[tuple[str, ...], list[str]] = {}
    for name in source.others:
        if name.lower() != "i" or name in source.wide:  # a counter, not currents
            groups.setdefault(tuple(words(name)), []).append(name)
    found: dict[str, dict[str, Any]] = {}
    for channel, kinds in WORDS.items():
        names = _find_labelled(source, channel, kinds) if channel in JOINT_CHANNELS else []
        if channel not in source.channels and (names := names or _find_candidates(groups, channel, kinds)):
            found[channel] = {"name": names if len(names) > 1 else names[0]} | _find_unit(channel, names[0])
    commanded = "torque" in found and bool(COMMANDS & set(words(str(found["torque"]["name"]))))
    if "torque" not in source.channels and (commanded or "torque" not in found):
        names = _find_candidates(groups, "current", CURRENTS) or _find_labelled(source, "current", CURRENTS)
        if names:
            unit = _find_unit("current", names[0]) or {"unit": "A"}
            found["torque"] = {"name": names if len(names) > 1 else names[0]} | unit
            return found | _find_others(groups, {*found, *source.channels}), "motor_current"
    return found | _find_others(groups, {*found, *source.channels}), "command" if commanded else None


def _find_others(groups: dict[tuple[str, ...], list[str]], known: set[str]) -> dict[str, dict[str, Any]]:
    """Find each necessary channel that is missing, if only one measured signal has a word of it in its name."""
    found: dict[str, dict[str, Any]] = {}
    for channel in ("time", "position", "torque"):
        signals = [key for key in groups if WORDS[channel] & set(key) and not (OTHERS | COMMANDS) & set(key)]
        if len(signals) == 1 and channel not in known:
            names = groups[signals[0]]
            found[channel] = {"name": names if len(names) > 1 else names[0]} | _find_unit(channel, names[0])
    return found


def find_command(source: Recording) -> str | None:
    """Find the array, or the prefix of the columns, whose name suggests desired joint positions."""
    names = [name.rpartition(".")[0] or name for name in source.others]
    return next((name for name in names if {"action", *COMMANDS} & set(words(name))), None)


def _find_unit(channel: str, name: str) -> dict[str, str]:
    """Find a unit of the channel in a name."""
    own = {*words(name), *re.findall("[a-z]+", name.lower())}
    if channel == "velocity" and own & set(UNITS["position"]):
        return {} if "rad" in own else {"unit": "turn/s"} if own & set(TURNS) else {"unit": "deg/s"}
    return next(({"unit": unit} for word, unit in UNITS.get(channel, {}).items() if word in own), {})


def _find_candidates(groups: dict[tuple[str, ...], list[str]], channel: str, kinds: set[str]) -> list[str]:
    """Find the columns whose names suggest the channel best, apart from numbers and words without meaning."""
    ranks = {key: _rank(key, kinds, channel) for key in groups}
    ranked = sorted((rank, key) for key, rank in ranks.items() if rank is not None)
    return groups[ranked[0][1]] if ranked else []


def _rank(key: tuple[str, ...], kinds: set[str], channel: str) -> tuple[int, int] | None:
    """Rank how closely the words of a name match a channel; None if they suggest another signal."""
    own = kinds & set(key)
    wrong = OTHERS & set(key) or (COMMANDS & set(key) if channel != "torque" else set())
    idle = {"robot", "log", "data"} | TIMES | {unit for units in UNITS.values() for unit in units}
    idle |= {"field"}  # of `rostopic echo -p`
    idle |= (
        {"j", "m", "axis", "motor", "motors", "drive", "drives", "servo", "servos"}
        if channel in UNITS
        else {"base", "imu", "body", "foot", "feet"}
    )
    rest = set(key) - kinds - MEASURED - COMMANDS - idle
    if not own or wrong or rest:
        return None
    return len(COMMANDS & set(key)), -len(MEASURED & set(key))


def _find_labelled(source: Recording, channel: str, kinds: set[str]) -> list[str]:
    """Find the columns of a channel with joint names in their names: `knee_pos`, `q_knee`, `knee [deg]`."""
    single = [name for name in source.others if name not in source.wide and not name.endswith((".csv", ".parquet"))]
    of_others = {"position": CURRENTS, "current": WORDS["position"] | WORDS["velocity"]}.get(channel, set())
    for own, wrong in ((kinds, of_others), (set(UNITS[channel]) - {"a"}, TIMES)):
        names = [name for name in single if own & set(words(name))]
        names = [name for name in names if not (OTHERS | COMMANDS | wrong) & set(words(name))]
        rests = {tuple(word for word in words(name) if word not in own) for name in names}
        if len(names) > 1 and len(rests) > 1:
            return names
    return []


def time_unit(stamps: Array) -> str:
    """Find the largest unit of time in which the stamps have a plausible rate; seconds if there is none."""
    steps = np.diff(stamps[np.isfinite(stamps)])
    steps = steps[steps > 0]
    step = float(np.median(steps)) if len(steps) else 1.0
    factors = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
    return next((unit for unit, factor in factors.items() if RATES[0] <= 1 / (step * factor) <= RATES[1]), "s")


def orientation_order(log: RobotLog) -> str:
    """Return "wxyz" if the base is upright only with the scalar of the quaternion first, else an empty string."""
    if log.base_orientation is None:
        return ""
    x, y, z = log.base_orientation.T[:3]
    upright, first = np.nanmedian(1 - 2 * (x**2 + y**2)), np.nanmedian(1 - 2 * (y**2 + z**2))
    return "wxyz" if first > upright + 0.7 else ""


def position_and_velocity_units(log: RobotLog, robot: Robot) -> list[tuple[str, str, str]]:
    """Find channel, unit and evidence if positions or velocities are not in radians."""
    low, high = robot.position_limits
    lowest, highest = np.nanmin(log.position, axis=0), np.nanmax(log.position, axis=0)
    turning = ~np.array(robot.prismatic)
    limited = turning & np.isfinite(low) & np.isfinite(high) & (highest - lowest > 0.02)
    wide = limited & ((lowest < low - 1.0) | (highest > high + 1.0))  # [rad]
    fits = (np.deg2rad(lowest) > low - 0.1) & (np.deg2rad(highest) < high + 0.1)
    speed = np.nanpercentile(np.abs(np.diff(log.position, axis=0)), 99, axis=0) / np.nanmedian(np.diff(log.time))
    degrees = wide.sum() >= max(1, 0.5 * limited.sum()) and bool(np.all(fits[limited]))
    # Without limits, joints faster than 60 rad/s are in degrees.
    degrees |= not limited.any() and np.count_nonzero(turning & (speed > 60.0)) >= max(1, 0.5 * turning.sum())
    why = "the positions are outside the model's limits in radians, and inside in degrees."
    position, velocity = "deg" if degrees else "rad", "deg/s" if degrees else "rad/s"
    if log.velocity is not None:
        slopes = position_slopes(log)
        middle = float(np.nanmedian(slopes)) if np.isfinite(slopes).any() else 1.0
        if units := units_of_slope(abs(middle)):
            position, velocity = units
            why = f"the positions change {middle:.4g} times as fast as the velocities."
    found = [("position", position, why)] if position != "rad" else []
    return found + ([("velocity", velocity, why)] if log.velocity is not None and velocity != "rad/s" else [])


def normalized_ranges(log: RobotLog, robot: Robot) -> dict[str, tuple[float, float]]:
    """Compute the positions [rad] that -100 and 100 mean by joint, if the log may have LeRobot's shares of a range.

    A gripper has shares from 0 to 100.
    """
    low, high = robot.position_limits
    lowest, highest = np.nanmin(log.position, axis=0), np.nanmax(log.position, axis=0)
    gripper = np.array(["gripper" in name.lower() for name in robot.joint_names])
    if (
        not np.isfinite(high - low).all()
        or np.maximum(-lowest, highest).max() > 100.5
        or (lowest < -0.5)[gripper].any()
    ):
        return {}
    low = np.where(gripper, 2 * low - high, low)
    return dict(zip(robot.joint_names, zip(low.tolist(), high.tolist(), strict=True), strict=True))


def servo_ticks(log: RobotLog) -> int:
    """Find the ticks per turn of positions that are integers around the middle of a servo's range; 0 otherwise."""
    known = log.position[np.isfinite(log.position)]
    highest = float(known.max(initial=0.0))
    if highest < 400 or known.min() < 0 or np.any(known != np.round(known)):  # whole degrees stay below
        return 0
    middle = float(np.median(known))
    return min(
        (turn for turn in (1024, 4096, 16384, 65536) if turn > highest), key=lambda t: abs(middle / t - 0.5), default=0
    )
