"""Messages of robot middleware, collected into streams: one a topic and set of joints."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from stribeck.log.readers.messages import Part
from stribeck.typing import Array

NANO = 1_000_000_000
MILLI = 1_000_000  # [ns]
TICKS = 1 << 32  # after which a counter of milliseconds begins anew
COUNTER_TOLERANCE = 0.02
"""Share by which a counter's span may differ from the recorder's, if it counts milliseconds of the same time."""
LATE = 20 * MILLI
"""How much later than others a message may be recorded, beside that [ns]."""


@dataclass(frozen=True, eq=False)
class Stream:
    """N messages of a topic that hold the same things.

    Attributes
    ----------
    message
        Type of the messages.
    labels
        Joint names of a `joints` stream.
    stamps
        [ns], shape (N,).
    values
        {channel: shape (N, k)}; k is the number of joints, or of the channel's components.
    stamped_by
        The header, a counter of milliseconds aboard that is laid on the recorder's time, or the recorder.
    """

    topic: str
    message: str
    kind: str
    labels: tuple[str, ...]
    stamps: NDArray[np.int64]
    values: Mapping[str, Array]
    stamped_by: Literal["header", "tick", "recorder"] = "header"


@dataclass
class _Growing:
    """A stream while its messages come in, in flat buffers: a list of arrays would take ten times the memory."""

    stamps: array[int] = field(default_factory=lambda: array("q"))
    ticks: array[int] = field(default_factory=lambda: array("q"))
    recorded: array[int] = field(default_factory=lambda: array("q"))
    values: dict[str, array[float]] = field(default_factory=dict)


def collect(
    messages: Iterable[tuple[str, str, int, Any]], path: str, read: Mapping[str, Callable[[Any, str], list[Part]]]
) -> list[Stream]:
    """Return the streams of (topic, message type, recorder's stamp [ns], message), whose parts `read` knows.

    Raises
    ------
    LogError
        If a message has more or fewer values than names, or a name twice.
    """
    growing: dict[tuple[str, str, str, tuple[str, ...], tuple[str, ...]], _Growing] = {}
    orders: dict[tuple[str, frozenset[str]], tuple[str, ...]] = {}
    for topic, name, recorded, message in messages:
        for part in read[name](message, f"{path}: a message of topic '{topic}'"):
            labels, values = part.labels, part.values
            order = orders.setdefault((topic, frozenset(labels)), labels)
            if order != labels:  # the names of a message say which value is which, whatever their order before
                places = [labels.index(label) for label in order]
                labels, values = order, {channel: np.asarray(numbers)[places] for channel, numbers in values.items()}
            stream = growing.setdefault((topic, name, part.kind, labels, tuple(values)), _Growing())
            stream.stamps.append(_stamp(message))
            stream.ticks.append(getattr(message, "tick", 0))
            stream.recorded.append(recorded)
            for channel, numbers in values.items():
                stream.values.setdefault(channel, array("d")).frombytes(np.asarray(numbers, dtype=np.float64).tobytes())
    return [_stream(*key[:4], stream) for key, stream in growing.items() if key[4]]


def _stamp(message: Any) -> int:
    """Return a message's own stamp [ns], of its header or by itself; 0 for none."""
    if hasattr(message, "header"):
        return int(message.header.stamp.sec * NANO + message.header.stamp.nanosec)
    return int(getattr(message, "stamp", 0))


def _stream(topic: str, name: str, kind: str, labels: tuple[str, ...], growing: _Growing) -> Stream:
    stamps = np.array(growing.stamps, dtype=np.int64)
    recorded = np.array(growing.recorded, dtype=np.int64)
    stamped_by: Literal["header", "tick", "recorder"] = "header"
    from_zero = stamps[0] == 0 and 0 < stamps[1:2].sum() < NANO  # as a simulation's do
    if (stamps[int(from_zero) :] <= 0).any() and (stamps != recorded).any():
        counted = _counted(np.array(growing.ticks, dtype=np.int64), recorded)
        stamps, stamped_by = (recorded, "recorder") if counted is None else (counted, "tick")
    values = {channel: np.frombuffer(flat).reshape(len(stamps), -1) for channel, flat in growing.values.items()}
    return Stream(topic, name, kind, labels, stamps, values, stamped_by)


def _counted(ticks: NDArray[np.int64], recorded: NDArray[np.int64]) -> NDArray[np.int64] | None:
    """Return a counter of milliseconds as stamps of the recorder's time [ns]; None if it counts something else.

    A message waits for the network before it is recorded, and has been counted before that.
    """
    since = np.concatenate([[0], np.cumsum(np.diff(ticks) % TICKS)]) * MILLI
    span = int(recorded[-1] - recorded[0])
    if since[-1] <= 0 or abs(since[-1] - span) > COUNTER_TOLERANCE * span + LATE:
        return None
    return since + np.int64(np.median(recorded - since))
