"""Channels of a log with other names and units than the standard ones."""

import re
from contextlib import suppress
from typing import Any

import numpy as np

from stribeck.check.audit.positions import in_degrees
from stribeck.check.init.names import WORDS, split
from stribeck.core.base.typing import Array, TorqueSource
from stribeck.core.errors import LogError
from stribeck.core.log import RobotLog
from stribeck.core.log.channels import JOINT_CHANNELS
from stribeck.core.log.clock import plausible_units
from stribeck.core.log.plausibility import position_slopes, units_of_slope, uprightness
from stribeck.core.robot import Robot
from stribeck.io import Recording

KINDS = {name: set(terms) for name, terms in (WORDS["channels"] | WORDS["kinds"]).items()}
"""Words in names of each channel, and of each kind of signal."""
UNITS = {name: {word: unit for unit, keys in units.items() for word in keys} for name, units in WORDS["units"].items()}
"""Words that are units -> their names in a robot file, by channel."""


def words(name: str) -> list[str]:
    """Split a name into lower-case words, without numbers."""
    return [word for word in split(name) if not word.isdigit()]


def is_motor_torque(name: str) -> bool:
    """Whether a name suggests measured torques of motors."""
    terms = set(words(name))
    return bool(KINDS["torque"] & terms and KINDS["motors"] & terms and not KINDS["commands"] & terms)


def numbers(source: Recording, channel: str) -> Array:
    """Load a channel, shape (T, columns); without rows if the log lacks it, or if it contains text."""
    with suppress(LogError):
        if channel in source.channels:
            clock = {"position": [0]} if "position" in source.channels else {}  # messages are joined on its stamps
            loaded, _ = source.load(clock | {channel: range(source.channels[channel].columns)})
            return np.asarray(loaded[channel], dtype=float)
    return np.empty((0, 1))


def constant_columns(source: Recording, channel: str) -> list[int]:
    """Find the columns of a channel that never change."""
    values = np.nan_to_num(numbers(source, channel))
    return np.flatnonzero(np.ptp(values, axis=0) == 0).tolist() if len(values) else []


def find_columns(source: Recording) -> tuple[dict[str, dict[str, Any]], TorqueSource | None]:
    """Find `[log.<channel>]` for channels with other names, and the source of the torque if names suggest it.

    Of several candidates for a channel, the one with the fewest contradicting words is used.
    """
    groups: dict[tuple[str, ...], list[str]] = {}
    for name in source.others:
        if name.lower() != "i" or name in source.wide:  # a counter, not currents
            groups.setdefault(tuple(words(name)), []).append(name)
    tables: dict[str, dict[str, Any]] = {}
    for channel in WORDS["channels"]:
        names = _find_labelled(source, channel) if channel in JOINT_CHANNELS else []
        if channel not in source.channels and (names := names or _find_candidates(groups, channel)):
            tables[channel] = _make_table(channel, names)
    commanded = "torque" in tables and bool(KINDS["commands"] & set(words(str(tables["torque"]["name"]))))
    torque_source: TorqueSource | None = "command" if commanded else None
    if "torque" not in source.channels and (commanded or "torque" not in tables):
        names = _find_candidates(groups, "current") or _find_labelled(source, "current")
        if names:
            tables["torque"], torque_source = _make_table("current", names), "motor_current"
    unmeasured = KINDS["others"] | KINDS["commands"]
    known = {*tables, *source.channels}
    for channel in [name for name in ("time", "position", "torque") if name not in known]:  # a single signal may be it
        signals = [key for key in groups if KINDS[channel] & set(key) and not unmeasured & set(key)]
        if len(signals) == 1:
            tables[channel] = _make_table(channel, groups[signals[0]])
    return tables, torque_source


def _make_table(channel: str, names: list[str]) -> dict[str, Any]:
    """Make a table `[log.<channel>]`, with the unit in the first name."""
    return {"name": names if len(names) > 1 else names[0]} | _find_unit(channel, names[0])


def find_command(source: Recording) -> str | None:
    """Find the array, or the prefix of the columns, whose name suggests desired joint positions."""
    names = [name.rpartition(".")[0] or name for name in source.others]
    return next((name for name in names if {"action", *KINDS["commands"]} & set(words(name))), None)


def _find_unit(channel: str, name: str) -> dict[str, str]:
    """Find a unit of the channel in a name."""
    terms = {*words(name), *re.findall("[a-z]+", name.lower())}
    if channel == "velocity" and (turned := {UNITS["position"][word] for word in terms & set(UNITS["position"])}):
        return {} if "rad" in turned else {"unit": "turn/s" if "turn" in turned else "deg/s"}
    default = {"unit": "A"} if channel == "current" else {}
    return next(({"unit": unit} for word, unit in UNITS.get(channel, {}).items() if word in terms), default)


def _find_candidates(groups: dict[tuple[str, ...], list[str]], channel: str) -> list[str]:
    """Find the columns whose names suggest the channel best, apart from numbers and words without meaning."""
    idle = KINDS["idle"].union(KINDS["times"], *UNITS.values(), KINDS["motors" if channel in UNITS else "bodies"])
    wrong = KINDS["others"] | (KINDS["commands"] if channel != "torque" else set())
    known = (KINDS[channel] | KINDS["measured"] | KINDS["commands"] | idle) - wrong
    fitting = [key for key in groups if KINDS[channel] & set(key) and known >= set(key)]
    commands, measured = KINDS["commands"], KINDS["measured"]
    best = min(fitting, key=lambda key: (len(commands & set(key)), -len(measured & set(key)), key), default=None)
    return groups[best] if best else []


def _find_labelled(source: Recording, channel: str) -> list[str]:
    """Find the columns of a channel with joint names in their names: `knee_pos`, `q_knee`, `knee [deg]`."""
    single = [name for name in source.others if name not in source.wide and not name.endswith((".csv", ".parquet"))]
    of_others = {"position": KINDS["current"], "current": KINDS["position"] | KINDS["velocity"]}.get(channel, set())
    for terms, wrong in ((KINDS[channel], of_others), (set(UNITS[channel]) - {"a"}, KINDS["times"])):
        names = [name for name in single if terms & set(words(name))]
        names = [name for name in names if not (KINDS["others"] | KINDS["commands"] | wrong) & set(words(name))]
        rests = {tuple(word for word in words(name) if word not in terms) for name in names}
        if len(names) > 1 and len(rests) > 1:
            return names
    return []


def time_unit(stamps: Array) -> str:
    """Find the largest unit of time in which the stamps have a plausible rate; seconds if there is none."""
    steps = np.diff(stamps[np.isfinite(stamps)])
    steps = steps[steps > 0]
    return next(iter(plausible_units(float(np.median(steps)) if len(steps) else 1.0)), "s")


def orientation_order(log: RobotLog) -> str:
    """Return "wxyz" if the base is upright only with the scalar of the quaternion first, else an empty string."""
    if log.base_orientation is None:
        return ""
    upright, first = uprightness(log.base_orientation)
    return "wxyz" if first > upright + 0.7 else ""


def position_and_velocity_units(log: RobotLog, robot: Robot) -> tuple[dict[str, str], str, bool]:
    """Find the units of positions and velocities that are not in radians, the evidence, and whether it is sure."""
    lowest, highest = np.nanmin(log.position, axis=0), np.nanmax(log.position, axis=0)
    speed = np.nanpercentile(np.abs(np.diff(log.position, axis=0)), 99, axis=0) / np.nanmedian(np.diff(log.time))
    degrees = in_degrees(robot, lowest, highest, speed).any()
    why = "is this the unit? The positions are outside the model's limits in radians, and inside in degrees."
    sure = False
    position, velocity = "deg" if degrees else "rad", "deg/s" if degrees else "rad/s"
    if log.velocity is not None:
        slopes = position_slopes(log)
        middle = float(np.nanmedian(slopes)) if np.isfinite(slopes).any() else 1.0
        if units := units_of_slope(abs(middle)):
            position, velocity = units
            why, sure = f"the positions change {middle:.4g} times as fast as the velocities.", True
    found = {"position": position} if position != "rad" else {}
    return found | ({"velocity": velocity} if log.velocity is not None and velocity != "rad/s" else {}), why, sure


def servo_ticks(log: RobotLog) -> int:
    """Find the ticks per turn of positions that are integers around the middle of a servo's range; 0 otherwise."""
    known = log.position[np.isfinite(log.position)]
    highest = float(known.max(initial=0.0))
    if highest < 400 or known.min() < 0 or np.any(known != np.round(known)):  # whole degrees stay below
        return 0
    middle = float(np.median(known))
    turns = (turn for turn in (1024, 4096, 16384, 65536) if turn > highest)
    return min(turns, key=lambda turn: abs(middle / turn - 0.5), default=0)
