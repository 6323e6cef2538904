"""Alternative names of channels in logs."""

from collections.abc import Mapping

from stribeck.core.settings import LogTable

ALIASES = {
    "time": ("t", "timestamp", "timestamps", "stamp", "stamps"),
    "position": ("q", "positions", "joint_position", "joint_positions", "joint_pos"),
    "velocity": ("qd", "dq", "qdot", "velocities", "joint_velocity", "joint_velocities", "joint_vel"),
    "acceleration": ("qdd", "ddq", "qddot", "accelerations", "joint_acceleration", "joint_accelerations"),
    "torque": ("tau", "effort", "efforts", "torques", "joint_torque", "joint_torques", "joint_effort", "joint_efforts"),
}
"""Channel -> its other names. Quaternions and IMU signals have none, because names do not define their order and frame.
"""


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
