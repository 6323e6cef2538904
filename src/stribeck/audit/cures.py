"""The line of the robot file that mends something."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from stribeck.robot import Robot

SHOWN = 6
"""Joints that a sentence names before it counts the others."""


def listed(names: Sequence[str]) -> str:
    """Return names in a row, the first few of many."""
    names = list(dict.fromkeys(names))
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return ", ".join(names[:SHOWN]) + more


def scale_line(robot: Robot, factors: Mapping[str, float]) -> str:
    """Return the setting that multiplies torques by factors, by joint, beside the scale that there is already.

    Joints of one factor get one number where they are all that have a torque, and the robot file scales none by name.
    """
    present = robot.log_table.torque.scale
    names = {model: logged for logged, model in robot.log_table.joint_names.items()}
    values = set(factors.values())
    everyone = set(factors) == {robot.joint_names[column] for column in robot.torque_controlled}
    if everyone and len(values) == 1 and isinstance(present, float | int):
        return f"set [log] torque = {{ scale = {present * values.pop():.4g} }}"
    if not isinstance(present, float | int | dict):
        return "change [log] torque scale, whose list follows the log's joint order"
    before = present if isinstance(present, dict) else dict.fromkeys(map(lambda j: names.get(j, j), factors), present)
    shown = {names.get(joint, joint): before.get(names.get(joint, joint), 1.0) * f for joint, f in factors.items()}
    parts = [f"{joint} = {factor:.4g}" for joint, factor in list(shown.items())[:SHOWN]]
    return f"set [log.torque] scale = {{ {', '.join(parts)}{', ...' if len(shown) > SHOWN else ''} }}"
