"""Topics of a bag: the numbers in their messages, which `[log]` may name, and their messages collected into streams."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stribeck.core.base.typing import IntArray
from stribeck.core.errors import LogError
from stribeck.core.log.channels import COMMAND, JOINT_CHANNELS
from stribeck.core.settings import LogTable
from stribeck.io.readers.join import NANO, Stream
from stribeck.io.readers.mapping import asked_names
from stribeck.io.readers.messages import READ, Part

Messages = Iterator[tuple[str, str, int, Any]]
"""Topic, type, recorder's stamp [ns] and content of each message."""
CLOCKS = ("sec", "nanosec", "nsec", "seconds", "nanos", "seq", "data_offset")
"""Fields of stamps and of the layout of arrays."""


@dataclass
class Topics:
    """Topics of a bag: fields that `[log]` names in messages of any type, others, and topics without a decoder."""

    fields: Mapping[str, Mapping[str, Sequence[str]]]
    others: dict[str, None] = field(default_factory=dict)
    refused: dict[str, LogError] = field(default_factory=dict)
    listed: set[str] = field(default_factory=set)

    def uses(self, topic: str, kind: str) -> bool:
        """Return whether the messages of a topic are read."""
        return kind in READ or topic in self.fields

    def add(self, topic: str, decode: Callable[[], object]) -> None:
        """Add the numbers of the first message of a topic that are not read, or the topic if it cannot be decoded."""
        if topic not in self.listed:
            self.listed.add(topic)
            names = [topic]
            with suppress(Exception):  # types without a definition, or damaged messages
                names = [f"{topic}.{name}" for name in list_numbers(decode())] or names
            self.others |= dict.fromkeys(name for name in names if name not in self.fields.get(topic, ()))

    def parts(self, topic: str, kind: str, message: Any, place: str) -> Iterable[Part]:
        """Split a message of a topic that is read."""
        if kind in READ:
            return READ[kind](message, place)
        self.add(topic, lambda: message)
        return parts_of_fields(message, self.fields[topic], place)


def asked_fields(table: LogTable) -> dict[str, dict[str, list[str]]]:
    """Collect {topic: {name in `[log]`: channels}}."""
    fields: dict[str, dict[str, list[str]]] = {}
    roles = COMMAND | {"external_torque": "torque"}  # read as another channel until their role is known
    for channel in JOINT_CHANNELS:
        for name in asked_names(table, channel):
            fields.setdefault(name.partition(".")[0], {}).setdefault(name, []).append(roles.get(channel, channel))
    return fields


def parts_of_fields(message: Any, names: Mapping[str, Sequence[str]], place: str) -> Iterator[Part]:
    """Read the fields that `[log]` names in a message: a number is a joint of this name, an array the message's joints.

    Without `joint_names` in the message, the joints of an array are numbered. The field of a topic without a field is
    `data`, as of `std_msgs/Float64MultiArray`.
    """
    for name, channels in names.items():
        field = name.partition(".")[2] or "data"
        try:
            values = _read(message, field)
        except AttributeError as error:
            fields = ", ".join(list_numbers(message))
            raise LogError(f"{place} has no field '{field}'; expected one of {fields}") from error
        labels = tuple(map(str, range(len(values)))) if np.ndim(values) else (name,)
        labels = tuple(joints) if len(joints := getattr(message, "joint_names", ())) == len(labels) else labels
        yield Part(labels, dict.fromkeys(channels, np.atleast_1d(values)), name)


def list_numbers(message: Any, prefix: str = "") -> Iterator[str]:
    """List the fields of a message that are numbers or arrays of them, except stamps."""
    for key, value in vars(message).items():
        value = value[0] if isinstance(value, list) and value and hasattr(value[0], "__dict__") else value
        if hasattr(value, "__dict__"):
            yield from list_numbers(value, f"{prefix}{key}.")
        elif not key.startswith("_") and key not in CLOCKS:
            with suppress(TypeError, ValueError):  # text
                if not isinstance(value, (str, bytes, bool)) and np.asarray(value, dtype=float).size:
                    yield f"{prefix}{key}"


def _read(message: Any, field: str) -> Any:
    """Read a field by its path, in every element of arrays of messages."""
    value = message
    for key in field.split("."):
        value = [getattr(entry, key) for entry in value] if isinstance(value, list) else getattr(value, key)
    return value


def collect(messages: Messages, path: str, topics: Topics) -> list[Stream]:
    """Collect messages into streams: one per topic and set of joints.

    Raises
    ------
    LogError
        If a message has more or fewer values than names, or a name twice.
    """
    # Flat buffers of a stream's clocks and channels; a list of arrays would take ten times the memory.
    growing: dict[tuple[str, str, tuple[str, ...], tuple[str, ...]], dict[str, array[Any]]] = {}
    orders: dict[tuple[str, frozenset[str]], tuple[str, ...]] = {}
    frames: dict[str, str] = {}
    for topic, name, recorded, message in messages:
        sent = topic
        for part in topics.parts(sent, name, message, f"{path}: a message of topic '{sent}'"):
            topic, labels, values = part.topic or sent, part.labels, part.values
            order = orders.setdefault((topic, frozenset(labels)), labels)
            if order != labels:  # names may change their order between messages
                places = [labels.index(label) for label in order]
                labels, values = order, {channel: np.asarray(numbers)[places] for channel, numbers in values.items()}
            frames.setdefault(topic, getattr(getattr(message, "header", message), "frame_id", ""))
            stream = growing.setdefault((topic, name, labels, tuple(values)), {})
            clocks = {"stamps": _read_stamp(message), "ticks": getattr(message, "tick", 0), "recorded": recorded}
            for clock, stamp in clocks.items():
                stream.setdefault(clock, array("q")).append(stamp)
            for channel, numbers in values.items():
                stream.setdefault(channel, array("d")).frombytes(np.asarray(numbers, dtype=np.float64).tobytes())
    return [_make_stream(*key[:3], frames[key[0]], stream) for key, stream in growing.items() if key[3]]


def _read_stamp(message: Any) -> int:
    """Read the stamp of a message [ns]; 0 if it has none. Its fields are named as in ROS 1, ROS 2 or protobuf."""
    stamp: Any = getattr(getattr(message, "header", message), "stamp", None) or getattr(message, "timestamp", None)
    seconds = getattr(stamp, "sec", getattr(stamp, "seconds", None))  # own messages may have another field of this name
    parts = [getattr(stamp, name) for name in ("nanosec", "nsec", "nanos") if hasattr(stamp, name)]
    return 0 if seconds is None else int(seconds * NANO + sum(parts))


def _make_stream(topic: str, name: str, labels: tuple[str, ...], frame: str, flat: dict[str, array[Any]]) -> Stream:
    stamps, ticks, recorded = (np.array(flat.pop(clock), dtype=np.int64) for clock in ("stamps", "ticks", "recorded"))
    values = {channel: np.frombuffer(numbers).reshape(len(stamps), -1) for channel, numbers in flat.items()}
    if (np.diff(recorded) < 0).any():  # files may store messages out of order
        order = np.argsort(recorded, kind="stable")
        stamps, ticks, recorded = stamps[order], ticks[order], recorded[order]
        values = {channel: numbers[order] for channel, numbers in values.items()}
    clock = ""
    from_zero = stamps[0] == 0 and 0 < stamps[1:2].sum() < NANO  # as in simulations
    if (stamps[int(from_zero) :] <= 0).any() and (stamps != recorded).any():
        counted = _convert_counter(ticks, recorded)
        stamps, clock = recorded, "the recorder's time is used"
        if counted is not None:
            stamps, clock = counted, "their millisecond counter is aligned with the recorder's time"
    return Stream(topic, name, labels, stamps, values, clock, frame)


def _convert_counter(ticks: IntArray, recorded: IntArray) -> IntArray | None:
    """Convert a millisecond counter to stamps of the recorder's time [ns]; None if it counts something else.

    The counter wraps around after 2^32. Messages are counted on board, and recorded after a network delay.
    """
    milli = 1_000_000  # [ns]
    since = np.concatenate([[0], np.cumsum(np.diff(ticks) % (1 << 32))]) * milli
    span = int(recorded[-1] - recorded[0])
    if since[-1] <= 0 or abs(since[-1] - span) > 0.02 * span + 20 * milli:  # messages may be recorded 20 ms late
        return None
    return since + np.int64(np.median(recorded - since))
