"""Topics of a bag, and their messages collected into streams."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stribeck.core.base.typing import IntArray
from stribeck.io.readers.fields import list_numbers, parts_of_fields
from stribeck.io.readers.join import NANO, Stream
from stribeck.io.readers.messages import READ, Part

Messages = Iterator[tuple[str, str, int, Any]]
"""Topic, type, recorder's stamp [ns] and content of each message."""


@dataclass
class Topics:
    """Topics of a bag: fields that `[log]` names in messages of any type, other topics, and other fields."""

    fields: Mapping[str, Mapping[str, Sequence[str]]]
    others: dict[str, None] = field(default_factory=dict)
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


def collect(messages: Messages, path: str, topics: Topics) -> list[Stream]:
    """Collect messages into streams: one per topic and set of joints.

    Raises
    ------
    LogError
        If a message has more or fewer values than names, or a name twice.
    """
    # Flat buffers of a stream's clocks and channels; a list of arrays would take ten times the memory.
    growing: dict[tuple[str, str, str, tuple[str, ...], tuple[str, ...]], dict[str, array[Any]]] = {}
    orders: dict[tuple[str, frozenset[str]], tuple[str, ...]] = {}
    for topic, name, recorded, message in messages:
        sent = topic
        for part in topics.parts(sent, name, message, f"{path}: a message of topic '{sent}'"):
            topic, labels, values = part.topic or sent, part.labels, part.values
            order = orders.setdefault((topic, frozenset(labels)), labels)
            if order != labels:  # names may change their order between messages
                places = [labels.index(label) for label in order]
                labels, values = order, {channel: np.asarray(numbers)[places] for channel, numbers in values.items()}
            stream = growing.setdefault((topic, name, part.kind, labels, tuple(values)), {})
            clocks = {"stamps": _read_stamp(message), "ticks": getattr(message, "tick", 0), "recorded": recorded}
            for clock, stamp in clocks.items():
                stream.setdefault(clock, array("q")).append(stamp)
            for channel, numbers in values.items():
                stream.setdefault(channel, array("d")).frombytes(np.asarray(numbers, dtype=np.float64).tobytes())
    return [_make_stream(*key[:4], stream) for key, stream in growing.items() if key[4]]


def _read_stamp(message: Any) -> int:
    """Read the stamp of a message [ns]; 0 if it has none. In JSON, its fields are named as in ROS 1 or Foxglove."""
    stamp: Any = message.header.stamp if hasattr(message, "header") else getattr(message, "timestamp", None)
    known = hasattr(stamp, "sec")  # own messages may have another field of this name
    return stamp.sec * NANO + getattr(stamp, "nanosec", getattr(stamp, "nsec", 0)) if known else 0


def _make_stream(topic: str, name: str, kind: str, labels: tuple[str, ...], flat: dict[str, array[Any]]) -> Stream:
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
    return Stream(topic, name, kind, labels, stamps, values, clock)


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
