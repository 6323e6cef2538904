"""Resampling of streams with different rates to one clock, the clock of the joint states."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.errors import LogError, listed
from stribeck.core.log.channels import COMMAND, JOINT_CHANNELS, VECTOR_CHANNELS, WRENCH, widened
from stribeck.core.log.clock import BRIDGED, RATES
from stribeck.core.settings import LogTable
from stribeck.io.readers.mapping import asked_names, resample
from stribeck.io.readers.recording import Arrays, Channel, Loaded, Recording, Wanted
from stribeck.io.readers.unitree import ORDERS

NANO = 1_000_000_000


KINDS = dict.fromkeys(JOINT_CHANNELS, "joints") | dict.fromkeys(VECTOR_CHANNELS, "imu")
KINDS |= {"foot_wrench": "wrench", "contact": "flag", "foot_force": "force"}
"""Kind of sensors of each channel."""


@dataclass(frozen=True, eq=False)
class Stream:
    """N messages of a topic, or rows of a file, with the same signals.

    Attributes
    ----------
    message
        Type of the messages.
    labels
        Names of the columns of its channels; empty for axes of an IMU, and for a topic that is a foot's.
    stamps
        Stamps [ns], shape (N,).
    values
        {channel: shape (N, k)}; k is the number of joints, or of the channel's components.
    clock
        Source of the stamps, if messages have none; empty otherwise.
    frame
        Name of the frame that the first message refers to, if any.
    """

    topic: str
    message: str
    labels: tuple[str, ...]
    stamps: IntArray
    values: Mapping[str, Array]
    clock: str = ""
    frame: str = ""

    @property
    def kind(self) -> str:
        """Kind of the sensors, the same for all channels."""
        return KINDS[next(iter(self.values))]


Part = tuple[Stream, int]
"""Stream, and its column for a joint, a foot or a component."""


def join(
    path: str, streams: Sequence[Stream], others: Sequence[str], table: LogTable, remarks: Sequence[str] = ()
) -> Recording:
    """Make the recording of some streams; they are interpolated when the used ones are known.

    The `remarks` become its first notes.

    Raises
    ------
    LogError
        If `[log] <channel>.name` names a topic that the log lacks.
    """
    streams, ignored = _select_used(streams, table)
    notes = [*remarks, *ignored]
    streams = _in_namespaces(_with_roles(streams, table, path), table, path)
    leaders = {"joints": "position", "imu": "base_orientation"}
    parts, rivals = dict[str, dict[str, Part]](), dict[str, dict[str, str]]()
    for channel, kind in KINDS.items():
        of_kind = [stream for stream in streams if stream.kind == kind]
        leader = "desired_position" if channel in COMMAND else leaders.get(kind, channel)
        chosen = _select_streams(of_kind, channel, leader, table, path)
        named = [(stream, _name_columns(stream, channel)) for stream in chosen if channel in stream.values]
        first = {stream.topic for stream, _ in parts.get("base_orientation", {}).values()} if kind == "imu" else set()
        parts[channel], rivals[channel] = _find_parts(named, channel, first, notes)
    taken = {stream.topic for columns in parts.values() for stream, _ in columns.values()}
    idle = dict.fromkeys(stream.topic for stream in streams if stream.topic not in taken)
    listed_parts = {name: list(columns.values()) for name, columns in parts.items()}
    motors = [stream for stream, _ in parts["position"].values() if stream.message in ORDERS]
    return Recording(
        path=path,
        channels={"time": Channel(1)}
        | {name: Channel(len(columns), tuple(columns)) for name, columns in parts.items() if columns},
        load=partial(_load_on_one_clock, listed_parts, table, path, notes),
        others=(*idle, *others),
        rivals={name: frames for name, frames in rivals.items() if frames},
        time_unit="ns",
        torque_source="motor_current" if motors else None,
        motor_orders=ORDERS[motors[0].message] if motors else {},
    )


def _select_streams(streams: list[Stream], channel: str, leader: str, table: LogTable, path: str) -> list[Stream]:
    """Select the streams of the topics that `[log]` names for a channel, or for the main channel of its message."""
    topics = {*(asked_names(table, channel) or asked_names(table, leader))}
    if missing := sorted(topics - {stream.topic for stream in streams}):
        raise LogError(
            f"{path}: [log.{channel}] name lists topic {listed(missing)}; topics of this type are "
            f"{listed([stream.topic for stream in streams])}"
        )
    return [stream for stream in streams if not topics or stream.topic in topics]


def _with_roles(streams: list[Stream], table: LogTable, path: str) -> list[Stream]:
    """Rename the channels of joint states that `[log]` names as commands or external torques."""
    commands = {topic for channel in COMMAND for topic in asked_names(table, channel)}
    for k, stream in enumerate(streams):
        if stream.kind == "joints" and stream.topic in commands:
            values = {name: stream.values[of] for name, of in COMMAND.items() if of in stream.values}
            streams[k] = replace(stream, values=values)
    if table.external_torque.name:  # the effort of a separate topic, which is used for nothing else
        efforts = [stream for stream in streams if stream.kind == "joints" and "torque" in stream.values]
        outside = _select_streams(efforts, "external_torque", "external_torque", table, path)
        streams = [replace(s, values={"external_torque": s.values["torque"]}) if s in outside else s for s in streams]
    return streams


def _in_namespaces(streams: list[Stream], table: LogTable, path: str) -> list[Stream]:
    """Name joints as `left/joint1` if topics of two namespaces measure the same joints, or `[log] joint_names` does."""
    measured = _select_streams([s for s in streams if "position" in s.values], "position", "position", table, path)
    pairs = [(s.topic, name) for s in [s for s in measured if _is_usual(s.topic)] or measured for name in s.labels]
    shared = Counter(name for _, name in dict.fromkeys(pairs))
    topics = [topic.split("/") for topic in dict.fromkeys(topic for topic, name in pairs if shared[name] > 1)]
    common = set[str]().union(*topics).intersection(*topics)
    named = {name.rpartition("/")[0] for name in table.joint_names if not name.startswith("/")} - {""}
    spaces = list(named) or ["/".join(word for word in topic if word not in common) for topic in topics]
    for k, stream in enumerate(streams if all(spaces) else ()):  # a topic without a namespace may repeat another
        space = next((space for space in spaces if f"/{space}/" in f"{stream.topic}/"), "")
        if space and stream.kind == "joints":
            streams[k] = replace(stream, labels=tuple(f"{space}/{label}" for label in stream.labels))
    return streams


def _name_columns(stream: Stream, channel: str) -> tuple[str, ...]:
    """Name the columns of a channel: joints, feet, axes, or the topic for the foot, with the axes of a wrench."""
    foot = widened([stream.topic], len(WRENCH) if channel == "foot_wrench" else 1)
    return stream.labels or VECTOR_CHANNELS.get(channel, foot)


def _find_parts(
    streams: Sequence[tuple[Stream, tuple[str, ...]]], channel: str, first: set[str], notes: list[str]
) -> tuple[dict[str, Part], dict[str, str]]:
    """Find the stream and column of each label; of two topics, use the usual one or one of the first.

    Returns
    -------
    parts, rivals
        Stream and column by label, and the frames of topics that contain the same label, of which none is usual.
    """
    offers: dict[str, list[Part]] = {}
    for stream, labels in streams:
        for column, label in enumerate(labels):
            offers.setdefault(label, []).append((stream, column))
    parts, rivals, lost = dict[str, Part](), dict[str, str](), dict[tuple[str, int], list[str]]()
    for label, candidates in offers.items():
        frames = {stream.topic: stream.frame for stream, _ in candidates}
        usual = [topic for topic in frames if _is_usual(topic) or topic in first] or [*frames]
        rivals |= frames if len(usual) > 1 else {}
        of_topic = [part for part in candidates if part[0].topic == usual[0]]
        parts[label] = max(of_topic, key=lambda part: len(part[0].stamps))
        if count := sum(len(stream.stamps) for stream, _ in of_topic) - len(parts[label][0].stamps):
            lost.setdefault((parts[label][0].topic, count), []).append(label)
    notes += [
        f"{count} messages of '{topic}' have other joints or signals than most: their {channel} of {listed(labels)} is "
        "ignored."
        for (topic, count), labels in lost.items()
    ]
    return parts, rivals


def _is_usual(topic: str) -> bool:
    """Return whether a topic is preferred; Unitree's robots send `lf/lowstate` too, at a low rate."""
    parts = topic.split("/")
    return parts[-1] == "joint_states" or (parts[-1] == "lowstate" and "lf" not in parts)


def _compute_rate(stream: Stream) -> float:
    """Compute the message rate of a stream [Hz]; 0 for a single message."""
    steps = np.diff(np.sort(stream.stamps))
    period = float(np.median(steps)) / NANO if steps.size else np.inf
    return 1 / period if period > 0 else np.inf


def _select_used(streams: Sequence[Stream], table: LogTable) -> tuple[list[Stream], list[str]]:
    """Select the streams that are fast enough for a robot's motion and have known units, and note the others."""
    measuring = [stream for stream in streams if stream.kind in ("imu", "wrench", "force")]  # flags are held
    slow = [stream for stream in measuring if _compute_rate(stream) < RATES[0]]
    notes = [
        f"'{stream.topic}' is ignored: {_compute_rate(stream):.4g} Hz is too slow for robot motion; expected at least "
        f"{RATES[0]:g} Hz."
        for stream in slow
    ]
    unscaled = table.foot_force.name is None and table.foot_force.scale == 1.0
    counts = [stream for stream in measuring if stream.kind == "force" and stream.message in ORDERS and unscaled]
    notes += [
        f"The foot forces of '{stream.topic}' are uncalibrated sensor counts and are not used; to use them, set "
        "[log.foot_force] scale in N per count."
        for stream in counts[:1]
    ]
    return [stream for stream in streams if stream not in slow + counts], notes


def _refuse_slow(stream: Stream, clock: Stream, path: str) -> None:
    rate, of_clock = _compute_rate(stream), _compute_rate(clock)
    slowest = max(of_clock / 10.0, RATES[0])  # with more rows per message, hardly a row is measured
    if stream.kind == "joints" and [*stream.values] != ["temperature"] and rate < slowest:
        raise LogError(
            f"{path}: '{stream.topic}' has {listed(list(stream.values))} of {listed(stream.labels)} at {rate:.4g} "
            f"Hz, but '{clock.topic}' has {of_clock:.4g} Hz; expected at least {slowest:.4g} Hz, because values "
            "between messages are interpolated"
        )


def _load_on_one_clock(
    parts: Mapping[str, list[Part]], table: LogTable, path: str, remarks: Sequence[str], wanted: Wanted
) -> Loaded:
    """Resample columns to the clock of the joint states, over the common time of all streams."""
    used = {name: [parts[name][i] if i >= 0 else None for i in plan] for name, plan in wanted.items() if name != "time"}
    positions = Counter(id(part[0]) for part in used.get("position", ()) if part)
    streams = list({id(part[0]): part[0] for columns in used.values() for part in columns if part}.values())
    clock = max(streams, key=lambda stream: (positions[id(stream)], len(stream.stamps)))
    first = max(int(stream.stamps.min()) for stream in streams)
    last = min(int(stream.stamps.max()) for stream in streams if stream.kind != "flag")  # a flag lasts until the next
    rows = np.flatnonzero((clock.stamps >= first) & (clock.stamps <= last))
    if len(rows) < 2:
        topics = listed([stream.topic for stream in streams])
        raise LogError(f"{path}: topics {topics} do not overlap in time; expected streams of one recording")
    common = slice(rows[0], rows[-1] + 1)
    stamps = clock.stamps[common]
    notes = [*remarks, *[f"The clock is '{clock.topic}'."][: len({s.topic for s in streams}) - 1]]
    if len(stamps) < len(clock.stamps):
        notes.append(f"{len(clock.stamps) - len(stamps)} messages outside the common time of all topics are ignored.")
    stamped = {stream.topic: stream.clock for stream in streams if stream.clock}
    notes += [f"'{topic}' has messages without stamps: {source}." for topic, source in stamped.items()]
    held = {id(part[0]) for name in COMMAND for part in used.get(name, ()) if part}
    on_clock: dict[int, Mapping[str, Array]] = {}
    for stream in streams:
        if np.array_equal(stream.stamps, clock.stamps):  # the clock, or other parts of the same messages
            on_clock[id(stream)] = {name: values[common] for name, values in stream.values.items()}
        else:
            if id(stream) not in held:
                _refuse_slow(stream, clock, path)
            on_clock[id(stream)], how = _resample(stream, stamps, clock.stamps[0], table, held=id(stream) in held)
            notes.append(how)
    arrays: Arrays = {"time": stamps[:, None]} if "time" in wanted else {}
    for name, columns in used.items():
        parted = [on_clock[id(p[0])][name][:, p[1]] if p else np.zeros(len(stamps)) for p in columns]
        arrays[name] = np.stack(parted, axis=1)
    return arrays, list(dict.fromkeys(notes))


def _resample(
    stream: Stream, stamps: IntArray, zero: int, table: LogTable, *, held: bool
) -> tuple[dict[str, Array], str]:
    """Resample a stream's channels to the clock's stamps, NaN in pauses, and describe the resampling.

    Flags and commands are `held` until the next one.
    """
    order = np.argsort(stream.stamps, kind="stable")  # messages may be recorded later than their successors
    time, query = (stream.stamps[order] - zero) / NANO, (stamps - zero) / NANO
    period = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    longest = max(table.max_gap or BRIDGED, 3.0 * period)  # stamps jitter
    values = {name: resample(name, query, time, own[order], longest, held=held) for name, own in stream.values.items()}
    how = "the last value is held" if held or stream.kind == "flag" else "interpolated"
    rate = f" from {1 / period:.4g} Hz" if period > 0 else ""
    return values, f"'{stream.topic}' is resampled{rate} ({how})."
