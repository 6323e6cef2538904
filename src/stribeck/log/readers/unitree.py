"""The order of the motors in the messages of Unitree's robots, which have no names there."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from stribeck.errors import LogError
from stribeck.log.readers.recording import JOINT_CHANNELS, Channel, Recording, listed
from stribeck.settings import LogTable

MOTOR = "motor_"
"""What the labels of motors begin with that only have a number."""

FEET = ("FR", "FL", "RR", "RL")
"""Of quadrupeds, in the order of their force sensors."""

_SHOULDER = ("shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow")
_ARM = (*_SHOULDER, "wrist_roll", "wrist_pitch", "wrist_yaw")


def _sides(first: str, second: str, joints: Sequence[str]) -> tuple[str, ...]:
    return tuple(f"{side}_{joint}" for side in (first, second) for joint in joints)


_REST = ("knee", "ankle_pitch", "ankle_roll")

ORDERS: dict[str, dict[str, tuple[str, ...]]] = {
    "unitree_go/msg/LowState": {
        "Go1, Go2, A1, B2": tuple(
            f"{leg}_{joint}" for leg in ("fr", "fl", "rr", "rl") for joint in ("hip", "thigh", "calf")
        ),
        "H1": (
            *_sides("right", "left", ("hip_roll", "hip_pitch", "knee")),
            *("waist_yaw", "left_hip_yaw", "right_hip_yaw", "", "left_ankle", "right_ankle"),
            *_sides("right", "left", _SHOULDER),
        ),
    },
    "unitree_hg/msg/LowState": {
        "G1": (
            *_sides("left", "right", ("hip_pitch", "hip_roll", "hip_yaw", *_REST)),
            *("waist_yaw", "waist_roll", "waist_pitch"),
            *_sides("left", "right", _ARM),
        ),
        "H1-2": (
            *_sides("left", "right", ("hip_yaw", "hip_pitch", "hip_roll", *_REST)),
            "waist_yaw",
            *_sides("left", "right", _ARM),
        ),
    },
}
"""Message type -> robot -> its joints, motor by motor (unitree_sdk2; a motor without a joint has no name)."""

SYNONYMS = {"torso": "waist_yaw", "elbow_pitch": "elbow", "elbow_roll": "wrist_roll"}
"""Names in some models of the same joints."""


def name_motors(source: Recording, table: LogTable, joints: Sequence[str]) -> tuple[Recording, list[str]]:
    """Return a source whose numbered motors have the names of the robot's joints, and what was taken.

    `[log] joint_order` has the last word; else it is the known order that has most of the robot's joints and, of two
    that have as many, the one in which more of them follow each other as in the robot: the hips of G1 and H1-2 differ.

    Raises
    ------
    LogError
        If two orders fit as well, or `[log] joint_order` has more joints than there are motors.
    """
    if not joints or not source.motor_orders:
        return source, []
    motors = [label for label in source.channels["position"].labels or () if label.startswith(MOTOR)]
    if table.joint_order:
        if len(table.joint_order) > len(motors):
            raise LogError(
                f"{source.path}: [log] joint_order has {len(table.joint_order)} joints; expected at most as many as "
                f"the log has motors, {len(motors)}"
            )
        return _renamed(source, dict(zip(motors, table.joint_order, strict=False))), []
    own = {joint: _normal(joint) for joint in joints}
    fits = {name: _fit(list(own.values()), order) for name, order in source.motor_orders.items()}
    best = [name for name, fit in fits.items() if fit == max(fits.values())]
    if fits[best[0]][0] == 0:
        return source, []
    if len(best) > 1:
        raise LogError(
            f"{source.path}: has {len(motors)} motors without names, and the robot's joints fit the order of "
            f"{listed(best)} as well; expected their names as [log] joint_order"
        )
    joint_of = {normal: joint for joint, normal in own.items()}
    order = [(f"{MOTOR}{number}", _normal(name)) for number, name in enumerate(source.motor_orders[best[0]])]
    names = {motor: joint_of[name] for motor, name in order if name in joint_of}
    first = next(iter(names))
    note = f"Motors have no names in the log: taken in the order of {best[0]}, in which {first} is {names[first]}."
    return _renamed(source, names), [note]


def _normal(joint: str) -> frozenset[str]:
    """Return a joint's name as words, in which usual spellings agree."""
    abbreviations = {"l": "left", "r": "right"}
    words = [abbreviations.get(word, word) for word in joint.lower().split("_")]
    text = "_".join(word for word in words if word not in ("joint", "leg", ""))
    for other, name in SYNONYMS.items():
        text = text.replace(other, name)
    return frozenset(text.split("_"))


def _fit(own: Sequence[frozenset[str]], order: Sequence[str]) -> tuple[int, int]:
    """Return how many of the robot's joints an order has, and how many of them follow each other there too."""
    places = {_normal(name): number for number, name in enumerate(order) if name}
    found = [places[joint] for joint in own if joint in places]
    return len(found), sum(after - before == 1 for before, after in pairwise(found))


def _renamed(source: Recording, names: dict[str, str]) -> Recording:
    channels = {
        name: Channel(channel.columns, tuple(names.get(label, label) for label in channel.labels))
        if name in JOINT_CHANNELS and channel.labels
        else channel
        for name, channel in source.channels.items()
    }
    return replace(source, channels=channels)
