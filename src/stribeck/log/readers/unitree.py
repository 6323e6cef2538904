"""Order of the motors in messages of Unitree's robots, where they have no names."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from stribeck.errors import LogError
from stribeck.log.readers.recording import JOINT_CHANNELS, Channel, Recording, listed
from stribeck.settings import LogTable

MOTOR = "motor_"
"""Prefix of the labels of numbered motors."""

FEET = ("FR", "FL", "RR", "RL")
"""Feet of quadrupeds, in the order of their force sensors."""

_SHOULDER = ("shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow")
_ARM = (*_SHOULDER, "wrist_roll", "wrist_pitch", "wrist_yaw")


def _both_sides(first: str, second: str, joints: Sequence[str]) -> tuple[str, ...]:
    return tuple(f"{side}_{joint}" for side in (first, second) for joint in joints)


_REST = ("knee", "ankle_pitch", "ankle_roll")

ORDERS: dict[str, dict[str, tuple[str, ...]]] = {
    "unitree_go/msg/LowState": {
        "Go1, Go2, A1, B2": tuple(
            f"{leg}_{joint}" for leg in ("fr", "fl", "rr", "rl") for joint in ("hip", "thigh", "calf")
        ),
        "H1": (
            *_both_sides("right", "left", ("hip_roll", "hip_pitch", "knee")),
            *("waist_yaw", "left_hip_yaw", "right_hip_yaw", "", "left_ankle", "right_ankle"),
            *_both_sides("right", "left", _SHOULDER),
        ),
    },
    "unitree_hg/msg/LowState": {
        "G1": (
            *_both_sides("left", "right", ("hip_pitch", "hip_roll", "hip_yaw", *_REST)),
            *("waist_yaw", "waist_roll", "waist_pitch"),
            *_both_sides("left", "right", _ARM),
        ),
        "H1-2": (
            *_both_sides("left", "right", ("hip_yaw", "hip_pitch", "hip_roll", *_REST)),
            "waist_yaw",
            *_both_sides("left", "right", _ARM),
        ),
    },
}
"""Message type -> robot -> joints in the order of the motors (unitree_sdk2); a motor without a joint has no name."""

SYNONYMS = {"torso": "waist_yaw", "elbow_pitch": "elbow", "elbow_roll": "wrist_roll"}
"""Names of the same joints in some models."""


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
    own = {joint: _normalize(joint) for joint in joints}
    fits = {name: _count_matches(list(own.values()), order) for name, order in source.motor_orders.items()}
    best = [name for name, fit in fits.items() if fit == max(fits.values())]
    if fits[best[0]][0] == 0:
        return source, []
    if len(best) > 1:
        raise LogError(
            f"{source.path}: has {len(motors)} motors without names, and the robot's joints fit the orders of "
            f"{listed(best)} equally well; set [log] joint_order"
        )
    joint_of = {normal: joint for joint, normal in own.items()}
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
    for other, name in SYNONYMS.items():
        text = text.replace(other, name)
    return frozenset(text.split("_"))


def _count_matches(own: Sequence[frozenset[str]], order: Sequence[str]) -> tuple[int, int]:
    """Count the robot's joints in an order, and how many of them follow each other there too."""
    places = {_normalize(name): number for number, name in enumerate(order) if name}
    found = [places[joint] for joint in own if joint in places]
    return len(found), sum(after - before == 1 for before, after in pairwise(found))


def _rename(source: Recording, names: dict[str, str]) -> Recording:
    channels = {
        name: Channel(channel.columns, tuple(names.get(label, label) for label in channel.labels))
        if name in JOINT_CHANNELS and channel.labels
        else channel
        for name, channel in source.channels.items()
    }
    return replace(source, channels=channels)
