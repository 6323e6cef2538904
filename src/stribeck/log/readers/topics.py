"""Messages of robot middleware, collected into streams: one a topic and set of joints."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stribeck.errors import LogError
from stribeck.typing import Array

KINDS = {
    "sensor_msgs/msg/JointState": "joints",
    "sensor_msgs/msg/Imu": "imu",
    "geometry_msgs/msg/WrenchStamped": "wrench",
    "std_msgs/msg/Bool": "flag",
}
"""Message types that are read."""

NANO = 1_000_000_000


@dataclass(frozen=True, eq=False)
class Stream:
    """N messages of a topic that hold the same things.

    Attributes
    ----------
    labels
        Joint names of a `joints` stream.
    stamps
        Of the header, or of the recorder where the header has none [ns], shape (N,).
    values
        {channel: shape (N, k)}; k is the number of joints, or of the channel's components.
    """

    topic: str
    kind: str
    labels: tuple[str, ...]
    stamps: NDArray[np.int64]
    values: Mapping[str, Array]
    recorder_time: bool = False


@dataclass
class _Growing:
    """A stream while its messages come in, in flat buffers: a list of arrays would take ten times the memory."""

    stamps: array[int] = field(default_factory=lambda: array("q"))
    recorded: array[int] = field(default_factory=lambda: array("q"))
    values: dict[str, array[float]] = field(default_factory=dict)


def collect(messages: Iterable[tuple[str, str, int, Any]], path: str) -> list[Stream]:
    """Return the streams of (topic, message type, recorder's stamp [ns], message).

    Raises
    ------
    LogError
        If a message has more or fewer values than names, or a name twice.
    """
    growing: dict[tuple[str, str, tuple[str, ...], tuple[str, ...]], _Growing] = {}
    orders: dict[tuple[str, frozenset[str]], tuple[str, ...]] = {}
    for topic, kind, recorded, message in messages:
        labels, values = _content(KINDS[kind], message, topic, path)
        order = orders.setdefault((topic, frozenset(labels)), labels)
        if order != labels:  # the names of a message say which value is which, whatever their order in the one before
            places = [labels.index(label) for label in order]
            labels, values = order, {channel: np.asarray(numbers)[places] for channel, numbers in values.items()}
        stream = growing.setdefault((topic, KINDS[kind], labels, tuple(values)), _Growing())
        stamp = message.header.stamp if hasattr(message, "header") else None
        stream.stamps.append(stamp.sec * NANO + stamp.nanosec if stamp else 0)
        stream.recorded.append(recorded)
        for channel, numbers in values.items():
            stream.values.setdefault(channel, array("d")).frombytes(np.asarray(numbers, dtype=np.float64).tobytes())
    return [_stream(*key[:3], stream) for key, stream in growing.items() if key[3]]


def _stream(topic: str, kind: str, labels: tuple[str, ...], growing: _Growing) -> Stream:
    stamps = np.array(growing.stamps, dtype=np.int64)
    recorded = np.array(growing.recorded, dtype=np.int64)
    unstamped = bool((stamps <= 0).any() and (stamps != recorded).any())
    if unstamped:
        stamps = recorded
    values = {name: np.frombuffer(flat).reshape(len(stamps), -1) for name, flat in growing.values.items()}
    return Stream(topic, kind, labels, stamps, values, recorder_time=unstamped)


def _content(kind: str, message: Any, topic: str, path: str) -> tuple[tuple[str, ...], dict[str, Any]]:
    """Return the joint names of a message, and its values by channel; what a message leaves empty is left out."""
    if kind == "joints":
        names = tuple(message.name)
        values = {"position": message.position, "velocity": message.velocity, "torque": message.effort}
        values = {channel: numbers for channel, numbers in values.items() if len(numbers)}
        twice = [name for name, count in Counter(names).items() if count > 1]
        if twice:
            raise LogError(f"{path}: a message of topic '{topic}' names joint '{twice[0]}' twice; expected each once")
        uneven = [channel for channel, numbers in values.items() if len(numbers) != len(names)]
        if uneven:
            raise LogError(
                f"{path}: a message of topic '{topic}' has {len(names)} joint names and {len(values[uneven[0]])} "
                f"values of {uneven[0]}; expected one value a name, or none"
            )
        return names, values
    if kind == "imu":
        rotation, speed, push = message.orientation, message.angular_velocity, message.linear_acceleration
        parts = {
            "base_orientation": (message.orientation_covariance, (rotation.x, rotation.y, rotation.z, rotation.w)),
            "angular_velocity": (message.angular_velocity_covariance, (speed.x, speed.y, speed.z)),
            "linear_acceleration": (message.linear_acceleration_covariance, (push.x, push.y, push.z)),
        }
        return (), {name: part for name, (covariance, part) in parts.items() if covariance[0] != -1}  # -1: not measured
    if kind == "wrench":
        force, moment = message.wrench.force, message.wrench.torque
        return (), {"foot_wrench": (force.x, force.y, force.z, moment.x, moment.y, moment.z)}
    return (), {"contact": (float(message.data),)}
