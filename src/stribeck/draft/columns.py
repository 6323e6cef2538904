"""Which arrays or columns of a log hold what, where they do not have the names that are read without a setting."""

from __future__ import annotations

import re
from typing import Any

from stribeck.log.readers.source import JOINT_CHANNELS, Source
from stribeck.typing import TorqueSource

WORDS: dict[str, set[str]] = {
    "time": {"time", "t", "timestamp", "timestamps", "stamp", "stamps", "sec", "secs", "seconds", "clock"},
    "position": {"position", "positions", "pos", "q", "qpos", "angle", "angles", "theta", "jpos"},
    "torque": {"torque", "torques", "tau", "effort", "efforts", "moment", "moments"},
    "velocity": {"velocity", "velocities", "vel", "dq", "qd", "qvel", "speed", "omega", "jvel"},
    "base_orientation": {"orientation", "quat", "quaternion", "attitude"},
    "contact": {"contact", "contacts"},
}
"""Words of names that a channel may have."""
CURRENTS = {"current", "currents"}
"""Words of motor currents, which are taken for torques that were not measured."""
MEASURED = {
    *("meas", "measured", "msr", "actual", "act", "state", "raw", "est", "estimated"),
    *("joint", "joints", "j", "dof"),
}
"""Words of what was measured, which is taken before others of its kind."""
OTHERS = {"error", "fric", "friction", "model", "limit", "filt", "ext", "external", "gravity", "coriolis"}
"""Words of what was not."""
COMMANDS = {
    *("cmd", "command", "commanded", "con", "control", "ctrl", "target", "ref", "reference"),
    *("des", "desired", "d"),
}
"""Words of what was asked for: a torque of them is taken where there is no other, nor a current."""


def words(name: str) -> list[str]:
    """Return the words of a name in small letters, without its numbers."""
    return [part.lower() for part in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", name)]


def find_columns(source: Source) -> tuple[dict[str, dict[str, Any]], TorqueSource | None]:
    """Return `[log.<channel>]` of channels that a log holds under other names, and what its torques are, if names say.

    Of several that a channel may be, the one with the fewest words that say otherwise is taken.
    """
    groups: dict[tuple[str, ...], list[str]] = {}
    for name in source.others:
        groups.setdefault(tuple(words(name)), []).append(name)
    found: dict[str, dict[str, Any]] = {}
    for channel, kinds in WORDS.items():
        names = _labelled(source, kinds) if channel in JOINT_CHANNELS else []
        if channel not in source.channels and (names := names or _called(groups, kinds, channel)):
            found[channel] = {"name": names[0] if len(names) == 1 else names}
    commanded = "torque" in found and bool(COMMANDS & set(words(str(found["torque"]["name"]))))
    if "torque" not in source.channels and (commanded or "torque" not in found):
        names = _called(groups, CURRENTS, "current") or _labelled(source, CURRENTS)
        if names:
            found["torque"] = {"name": names[0] if len(names) == 1 else names, "unit": "A"}
            return found, "motor_current"
    return found, "command" if commanded else None


def _called(groups: dict[tuple[str, ...], list[str]], kinds: set[str], channel: str) -> list[str]:
    """Return the names of a log that say a channel, best of several."""
    ranks = {key: _rank(key, kinds, channel) for key in groups}
    ranked = sorted((rank, key) for key, rank in ranks.items() if rank is not None)
    return groups[ranked[0][1]] if ranked else []


def _rank(key: tuple[str, ...], kinds: set[str], channel: str) -> tuple[int, int] | None:
    """Return how far the words of a name are from a channel's, None if they are of something else."""
    own = kinds & set(key)
    wrong = OTHERS & set(key) or (COMMANDS & set(key) if channel != "torque" else set())
    rest = set(key) - kinds - MEASURED - COMMANDS - {"base", "imu", "body", "foot", "feet", "robot", "log", "data"}
    if not own or wrong or rest:
        return None
    return len(COMMANDS & set(key)), -len(MEASURED & set(key))


def _labelled(source: Source, kinds: set[str]) -> list[str]:
    """Return the columns of a channel whose names hold the joint's: `knee_pos`, `q_knee`."""
    single = [name for name in source.others if name not in source.wide]
    own = [name for name in single if kinds & set(words(name)) and not (OTHERS | COMMANDS) & set(words(name))]
    rests = {tuple(word for word in words(name) if word not in kinds) for name in own}
    return own if len(rests) > 1 else []
