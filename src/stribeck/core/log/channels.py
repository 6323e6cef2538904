"""Names of channels in logs, of their columns, and units."""

from collections.abc import Sequence

import numpy as np

from stribeck.core.log.robot_log import RobotLog

XYZW = ("x", "y", "z", "w")
WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
COMMAND = {"desired_position": "position", "desired_velocity": "velocity", "desired_torque": "torque"}
"""Channels of a command -> the commanded channel."""
JOINT_CHANNELS = ("position", "torque", "velocity", "acceleration", "temperature", "external_torque", *COMMAND)
VECTOR_CHANNELS = {"base_orientation": XYZW, "angular_velocity": XYZW[:3], "linear_acceleration": XYZW[:3]}
FOOT_CHANNELS = ("contact", "foot_wrench", "foot_force")
CHANNELS = ("time", *JOINT_CHANNELS, *VECTOR_CHANNELS, *FOOT_CHANNELS)

TURN = 2 * np.pi  # [rad]
ANGLE = {"rad": 1.0, "deg": TURN / 360, "turn": TURN, "m": 1.0, "mm": 1e-3}
SPEED = {"rad/s": 1.0, "deg/s": TURN / 360, "rpm": TURN / 60, "krpm": TURN / 0.06, "turn/s": TURN}
SPEED |= {"m/s": 1.0, "mm/s": 1e-3}


def widened(names: Sequence[str], width: int) -> tuple[str, ...]:
    """Expand names to column names: the names themselves, or six per name if `width` is the width of a wrench."""
    return tuple(names) if width == 1 else tuple(f"{name}.{axis}" for name in names for axis in WRENCH)


def column_names(log: RobotLog, channel: str) -> list[str]:
    """Name the columns of a channel as in a log in Parquet or CSV, e.g. `position.knee`."""
    if channel == "time":
        return ["time"]
    labels: Sequence[str] = VECTOR_CHANNELS.get(channel, log.joint_names)
    if channel in FOOT_CHANNELS:
        labels = widened(log.foot_names, len(WRENCH) if channel == "foot_wrench" else 1)
    return [f"{channel}.{label}" for label in labels]
