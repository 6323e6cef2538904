"""Names that can only mean one channel, read where a log has none of the channel's own name."""

from collections.abc import Mapping

from stribeck.settings import LogTable

ALIASES = {
    "time": ("t", "timestamp", "timestamps", "stamp", "stamps"),
    "position": ("q", "positions", "joint_position", "joint_positions", "joint_pos"),
    "velocity": ("qd", "dq", "qdot", "velocities", "joint_velocity", "joint_velocities", "joint_vel"),
    "acceleration": ("qdd", "ddq", "qddot", "accelerations", "joint_acceleration", "joint_accelerations"),
    "torque": ("tau", "effort", "efforts", "torques", "joint_torque", "joint_torques", "joint_effort", "joint_efforts"),
}
"""Channel -> its other names. Quaternions and IMUs have none: their order and frame are not told by a name."""


def find_aliases(table: LogTable, offers: Mapping[str, int]) -> dict[str, str]:
    """Return under which other name a log holds a channel: {channel: name}.

    A name counts where it is the only one of its channel, and neither the channel's own name nor a setting says where
    the channel is; of a channel that no fit needs, only beside as many columns of positions.

    Parameters
    ----------
    offers
        {name in the log: its number of columns}.
    """
    found: dict[str, str] = {}
    for channel, names in ALIASES.items():
        there = [name for name in names if name in offers]
        if channel in offers or getattr(table, channel).name is not None or len(there) != 1:
            continue
        positions = offers.get(found.get("position", "position"))
        if channel in ("time", "position", "torque") or offers[there[0]] == positions:
            found[channel] = there[0]
    return found


def alias_note(found: Mapping[str, str]) -> list[str]:
    """Return the sentence that says which names were taken for what."""
    pairs = ", ".join(f"'{name}' as {channel}" for channel, name in found.items())
    return [f"Read by their usual names: {pairs}."] if found else []
