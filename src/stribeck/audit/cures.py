"""The line of the robot file that mends something."""

import re
from collections.abc import Mapping, Sequence

from stribeck.robot import Robot

SHOWN = 6
"""Joints that a sentence names before it counts the others."""
SHOWN_SCALES = 16


def listed(names: Sequence[str]) -> str:
    """Return names in a row, the first few of many."""
    names = list(dict.fromkeys(names))
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return ", ".join(names[:SHOWN]) + more


def scale_line(robot: Robot, factors: Mapping[str, float], channel: str = "torque") -> str:
    """Return the setting that multiplies a channel by factors, by joint, beside the scale that there is already.

    It is one number where all joints that have a torque get the same, and else a value by the log's joint name.
    """
    present = getattr(robot.log_table, channel).scale
    joints = [robot.joint_names[column] for column in robot.torque_controlled]
    if isinstance(present, list):
        return f"change [log] {channel} scale, a list in the log's joint order"
    if set(factors) == set(joints) and len(set(factors.values())) == 1 and not isinstance(present, dict):
        return f"set [log] {channel} = {{ scale = {present * next(iter(factors.values())):.4g} }}"
    logged = {model: name for name, model in robot.log_table.joint_names.items()}
    scales = {}
    for joint in joints:
        name = logged.get(joint, joint)
        before = present.get(name, 1.0) if isinstance(present, dict) else present
        if joint in factors or before != 1:
            scales[name] = before * factors.get(joint, 1.0)
    shown = [f"{_key(name)} = {scale:.4g}" for name, scale in list(scales.items())[:SHOWN_SCALES]]
    return f"set [log.{channel}] scale = {{ {', '.join(shown)}{', ...' if len(scales) > SHOWN_SCALES else ''} }}"


def _key(name: str) -> str:
    """Return a name as a key of a TOML table."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else f'"{name}"'
