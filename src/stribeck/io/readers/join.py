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
from stribeck.core.log.interpolation import bridges, linear, previous, slerp
from stribeck.core.settings import LogTable
from stribeck.io.readers.recording import Arrays, Channel, Loaded, Recording, Wanted
from stribeck.io.readers.unitree import ORDERS

NANO = 1_000_000_000


@dataclass(frozen=True, eq=False)
class Stream:
    """N messages of a topic, or rows of a file, with the same signals.

    Attributes
    ----------
    message
        Type of the messages.
    kind
        "joints", "imu", "wrench", "force", "flag" or "slow".
    labels
        Joint names of a `joints` stream.
    stamps
        Stamps [ns], shape (N,).
    values
        {channel: shape (N, k)}; k is the number of joints, or of the channel's components.
    clock
        Source of the stamps, if messages have none; empty otherwise.
    """

    topic: str
    message: str
    kind: str
    labels: tuple[str, ...]
    stamps: IntArray
    values: Mapping[str, Array]
    clock: str = ""


KINDS = dict.fromkeys(JOINT_CHANNELS, "joints") | dict.fromkeys(VECTOR_CHANNELS, "imu")
KINDS |= {"foot_wrench": "wrench", "contact": "flag", "foot_force": "force"}
"""Kind of the streams of each channel."""
Part = tuple[Stream, int]
"""Stream, and its column for a joint, a foot or a component."""


def join(
    path: str, streams: Sequence[Stream], others: Sequence[str], table: LogTable, types: Sequence[str]
) -> Recording:
    """Make the recording of some streams; they are interpolated when the used ones are known.

    `types` are the message types with joints, for the message that they are missing.

    Raises
    ------
    LogError
        If two topics contain the same signal and `[log] <channel>.name` does not choose one.
    """
    joints = [stream for stream in streams if stream.kind == "joints"]
    if not joints:
        topics = tuple(dict.fromkeys([*(stream.topic for stream in streams), *others]))
        types = f"messages of type {listed(types)}, or numbers in other messages as '<topic>.<field>'"
        return Recording(path=path, channels={}, load=lambda _: ({}, []), others=topics, expected={"position": types})
    streams, notes = fast_enough(streams)
    streams = _in_namespaces(_with_roles(streams, table, path), table, path)
    leaders = {"joints": table.position.name, "imu": table.base_orientation.name}
    parts: dict[str, dict[str, Part]] = {}
    for channel, kind in KINDS.items():
        of_kind = [stream for stream in streams if stream.kind == kind]
        if kind == "force" and of_kind and table.foot_force.name is None and table.foot_force.scale == 1.0:
            notes.append(
                f"The foot forces of '{of_kind[0].topic}' are uncalibrated sensor counts and are not used; to use "
                "them, set [log.foot_force] scale in N per count."
            )
            continue
        leader = table.desired_position.name if channel in COMMAND else leaders.get(kind)
        chosen = _select_streams(of_kind, channel, leader, table, path)
        named = [(stream, _name_columns(stream, channel)) for stream in chosen if channel in stream.values]
        parts[channel] = _find_parts(named, channel, path, notes)
    taken = {stream.topic for columns in parts.values() for stream, _ in columns.values()}
    idle = dict.fromkeys(stream.topic for stream in streams if stream.topic not in taken)
    listed_parts = {name: list(columns.values()) for name, columns in parts.items()}
    motors = [stream for stream, _ in parts["position"].values() if stream.message in ORDERS]
    return Recording(
        path=path,
        channels={"time": Channel(1)}
        | {name: Channel(len(columns), tuple(columns)) for name, columns in parts.items() if columns},
        load=partial(load_on_one_clock, listed_parts, table, path, notes),
        others=(*idle, *others),
        time_unit="ns",
        torque_source="motor_current" if motors else None,
        motor_orders=ORDERS[motors[0].message] if motors else {},
    )


def _select_streams(
    streams: list[Stream], channel: str, leader: str | list[str] | None, table: LogTable, path: str
) -> list[Stream]:
    """Select the streams of the topics that `[log]` names for a channel, or for the main channel of its message."""
    topics = _collect_topics(getattr(table, channel).name or leader)
    if missing := sorted(topics - {stream.topic for stream in streams}):
        raise LogError(
            f"{path}: [log.{channel}] name lists topic {listed(missing)}; topics of this type are "
            f"{listed([stream.topic for stream in streams])}"
        )
    return [stream for stream in streams if not topics or stream.topic in topics]


def _with_roles(streams: list[Stream], table: LogTable, path: str) -> list[Stream]:
    """Rename the channels of joint states that `[log]` names as commands or external torques."""
    commands = {topic for channel in COMMAND for topic in _collect_topics(getattr(table, channel).name)}
    for k, stream in enumerate(streams):
        if stream.kind == "joints" and stream.topic in commands:
            values = {name: stream.values[of] for name, of in COMMAND.items() if of in stream.values}
            streams[k] = replace(stream, values=values)
    if table.external_torque.name:  # the effort of a separate topic, which is used for nothing else
        efforts = [stream for stream in streams if stream.kind == "joints" and "torque" in stream.values]
        outside = _select_streams(efforts, "external_torque", None, table, path)
        streams = [replace(s, values={"external_torque": s.values["torque"]}) if s in outside else s for s in streams]
    return streams


def _in_namespaces(streams: list[Stream], table: LogTable, path: str) -> list[Stream]:
    """Name joints as `left/joint1` if topics of two namespaces measure the same joints, or `[log] joint_names` does."""
    measured = _select_streams([s for s in streams if "position" in s.values], "position", None, table, path)
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
    if channel in VECTOR_CHANNELS:
        return VECTOR_CHANNELS[channel]
    return {"foot_wrench": widened([stream.topic], len(WRENCH)), "contact": (stream.topic,)}.get(channel, stream.labels)


def _collect_topics(name: str | list[str] | None) -> set[str]:
    """Collect the topics that a setting names."""
    return {name} if isinstance(name, str) else set(name or ())


def _find_parts(
    streams: Sequence[tuple[Stream, tuple[str, ...]]], channel: str, path: str, notes: list[str]
) -> dict[str, Part]:
    """Find the stream and column of each label; of two topics, use the usual one or refuse the label."""
    offers: dict[str, list[Part]] = {}
    for stream, labels in streams:
        for column, label in enumerate(labels):
            offers.setdefault(label, []).append((stream, column))
    parts, lost = dict[str, Part](), dict[tuple[str, int], list[str]]()
    for label, candidates in offers.items():
        topics = list(dict.fromkeys(stream.topic for stream, _ in candidates))
        usual = [topic for topic in topics if _is_usual(topic)]
        if len(topics) > 1 and len(usual) != 1:
            raise LogError(
                f"{path}: topics {listed(topics)} all contain {channel} of '{label}'; choose one by "
                f'[log.{channel}] name = "{topics[0]}"'
            )
        of_topic = [part for part in candidates if part[0].topic == (usual or topics)[0]]
        parts[label] = max(of_topic, key=lambda part: len(part[0].stamps))
        if count := sum(len(stream.stamps) for stream, _ in of_topic) - len(parts[label][0].stamps):
            lost.setdefault((parts[label][0].topic, count), []).append(label)
    notes += [
        f"{count} messages of '{topic}' have other joints or signals than most: their {channel} of {listed(labels)} is "
        "ignored."
        for (topic, count), labels in lost.items()
    ]
    return parts


def _is_usual(topic: str) -> bool:
    """Return whether a topic is preferred; Unitree's robots send `lf/lowstate` too, at a low rate."""
    parts = topic.split("/")
    return parts[-1] == "joint_states" or (parts[-1] == "lowstate" and "lf" not in parts)


def _compute_rate(stream: Stream) -> float:
    """Compute the message rate of a stream [Hz]; 0 for a single message."""
    steps = np.diff(np.sort(stream.stamps))
    period = float(np.median(steps)) / NANO if steps.size else np.inf
    return 1 / period if period > 0 else np.inf


def fast_enough(streams: Sequence[Stream]) -> tuple[list[Stream], list[str]]:
    """Select the streams that are fast enough for a robot's motion, and note the others."""
    measuring = [stream for stream in streams if stream.kind in ("imu", "wrench", "force")]  # flags are held
    slow = [stream for stream in measuring if _compute_rate(stream) < RATES[0]]
    notes = [
        f"'{stream.topic}' is ignored: {_compute_rate(stream):.4g} Hz is too slow for robot motion; expected at least "
        f"{RATES[0]:g} Hz."
        for stream in slow
    ]
    return [stream for stream in streams if stream not in slow], notes


def _refuse_slow(stream: Stream, clock: Stream, path: str) -> None:
    rate, of_clock = _compute_rate(stream), _compute_rate(clock)
    slowest = max(of_clock / 10.0, RATES[0])  # with more rows per message, hardly a row is measured
    if stream.kind == "joints" and rate < slowest:
        raise LogError(
            f"{path}: '{stream.topic}' has {listed(list(stream.values))} of {listed(stream.labels)} at {rate:.4g} "
            f"Hz, but '{clock.topic}' has {of_clock:.4g} Hz; expected at least {slowest:.4g} Hz, because values "
            "between messages are interpolated"
        )


def load_on_one_clock(
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
    return arrays, notes


def _resample(
    stream: Stream, stamps: IntArray, zero: int, table: LogTable, *, held: bool
) -> tuple[dict[str, Array], str]:
    """Resample a stream's channels to the clock's stamps, NaN in pauses, and describe the resampling.

    Flags and commands are `held` until the next one.
    """
    held = held or stream.kind == "flag"
    order = np.argsort(stream.stamps, kind="stable")  # messages may be recorded later than their successors
    time, query = (stream.stamps[order] - zero) / NANO, (stamps - zero) / NANO
    period = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    longest = max(table.max_gap or BRIDGED, 3.0 * period)  # stamps jitter
    pauses = np.zeros(len(query), dtype=bool) if held else bridges(query, time, longest)
    result = {}
    for name, values in stream.values.items():
        between = previous if held else slerp if name == "base_orientation" else linear
        result[name] = np.asarray(between(query, time, values[order]), dtype=np.float64)
        result[name][pauses] = np.nan
    how = "the last value is held" if held else "interpolated"
    rate = f" from {1 / period:.4g} Hz" if period > 0 else ""
    return result, f"'{stream.topic}' is resampled{rate} ({how})."
