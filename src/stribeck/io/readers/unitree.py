"""Order of the motors in messages of Unitree's robots, where they have no names."""

import tomllib
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

from stribeck.core.errors import LogError, listed
from stribeck.core.log.channels import JOINT_CHANNELS
from stribeck.core.settings import LogTable
from stribeck.io.readers.recording import Channel, Recording

MOTOR = "motor_"
"""Prefix of the labels of numbered motors."""

FEET = ("FR", "FL", "RR", "RL")
"""Feet of quadrupeds, in the order of their force sensors."""

ORDERS: dict[str, dict[str, list[str]]] = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
"""Message type -> robot -> joints in the order of the motors; a motor without a joint has no name."""


def name_motors(source: Recording, table: LogTable, joints: Sequence[str]) -> tuple[Recording, list[str]]:
    """Name the numbered motors of a source like the robot's joints, and note the assumed order.

    `[log] joint_order` has priority. Otherwise the known order with most of the robot's joints is used and, if two have
    as many, the one in which more of them follow each other as in the robot: hips of G1 and H1-2 differ.

    Raises
    ------
    LogError
        If two orders fit equally well, or `[log] joint_order` has more joints than there are motors.
    """
    if not joints or not source.motor_orders:
        return source, []
    motors = [label for label in source.channels["position"].labels or () if label.startswith(MOTOR)]
    if table.joint_order:
        if len(table.joint_order) > len(motors):
            raise LogError(
                f"{source.path}: [log] joint_order has {len(table.joint_order)} joints, but the log "
                f"has only {len(motors)} motors"
            )
        return _rename(source, dict(zip(motors, table.joint_order, strict=False))), []
    normals = {joint: _normalize(joint) for joint in joints}
    fits = {name: _count_matches(list(normals.values()), order) for name, order in source.motor_orders.items()}
    best = [name for name, fit in fits.items() if fit == max(fits.values())]
    if fits[best[0]][0] == 0:
        return source, []
    if len(best) > 1:
        raise LogError(
            f"{source.path}: has {len(motors)} motors without names, and the robot's joints fit the orders of "
            f"{listed(best)} equally well; set [log] joint_order"
        )
    joint_of = {normal: joint for joint, normal in normals.items()}
    order = [(f"{MOTOR}{number}", _normalize(name)) for number, name in enumerate(source.motor_orders[best[0]])]
    names = {motor: joint_of[name] for motor, name in order if name in joint_of}
    first = next(iter(names))
    note = f"Motors have no names in the log; the order of {best[0]} was assumed: {first} is {names[first]}."
    return _rename(source, names), [note]


def _normalize(joint: str) -> frozenset[str]:
    """Split a joint's name into words, normalized for usual spellings."""
    abbreviations = {"l": "left", "r": "right"}
    words = [abbreviations.get(word, word) for word in joint.lower().split("_")]
    text = "_".join(word for word in words if word not in ("joint", "leg", ""))
    for other, name in (("torso", "waist_yaw"), ("elbow_pitch", "elbow"), ("elbow_roll", "wrist_roll")):
        text = text.replace(other, name)
    return frozenset(text.split("_"))


def _count_matches(joints: Sequence[frozenset[str]], order: Sequence[str]) -> tuple[int, int]:
    """Count the robot's joints in an order, and how many of them follow each other there too."""
    places = {_normalize(name): number for number, name in enumerate(order) if name}
    numbers = [places[joint] for joint in joints if joint in places]
    return len(numbers), sum(after - before == 1 for before, after in pairwise(numbers))


def _rename(source: Recording, names: dict[str, str]) -> Recording:
    channels = {
        name: Channel(channel.columns, tuple(names.get(label, label) for label in channel.labels))
        if name in JOINT_CHANNELS and channel.labels
        else channel
        for name, channel in source.channels.items()
    }
    return replace(source, channels=channels)
