"""Which columns of a table are which channel, and their values."""

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from stribeck.errors import LogError
from stribeck.log.readers.aliases import alias_note, find_aliases
from stribeck.log.readers.source import CHANNELS, JOINT_CHANNELS, Arrays, Channel, Loaded, Source, listed
from stribeck.log.storage import allocate, check_size
from stribeck.settings import LogTable

Batches = Callable[[list[str], Collection[str]], Iterator[pa.RecordBatch]]
"""Reads columns; those of the second argument need not be floating-point numbers, but may be flags or dates."""

NUMBER = r"[._]?(?:(\d+)|\[(\d+)\])"
"""What follows a channel's name where its columns are numbered: `q_0`, `q0`, `q.0`, `q[0]`."""


@dataclass(frozen=True)
class Table:
    """A table that is not read yet.

    Attributes
    ----------
    path
        For messages.
    names
        Of its columns.
    rows
        At most so many.
    batches
        Gives the rows of some columns, batch by batch.
    on_disk
        Whether `path` is a file, whose size says how much it can hold.
    """

    path: str
    names: list[str]
    rows: int
    batches: Batches
    on_disk: bool = True


def source_of_columns(table: Table, settings: LogTable) -> Source:
    """Return the source of a table: its columns are named `<channel>.<label>`, are numbered, or as `[log]` says.

    Raises
    ------
    LogError
        If it lacks a column that `[log]` names, or has one of the wanted twice.
    """
    path, names = table.path, table.names
    aliases = find_aliases(settings, _offers(names))
    used = {channel: _columns_of(channel, names, settings, aliases.get(channel, channel), path) for channel in CHANNELS}
    for channel in ("velocity", "acceleration", "temperature"):  # numbers of joints only beside as many positions
        labels, columns = used[channel]
        if labels and labels[0].isdecimal() and len(columns) != len(used["position"][1]):
            used[channel] = (None, [])
    twice = [name for name, count in Counter(names).items() if count > 1]
    clash = sorted({name for _, columns in used.values() for name in columns if name in twice})
    if clash:
        raise LogError(f"{path}: holds column {listed(clash)} more than once; expected one column a name")
    taken = {name for _, columns in used.values() for name in columns}
    time = used["time"][1]
    return Source(
        path=path,
        channels={name: Channel(len(columns), labels) for name, (labels, columns) in used.items() if columns},
        load=partial(_load, {name: columns for name, (_, columns) in used.items()}, table, alias_note(aliases)),
        others=tuple(dict.fromkeys(re.sub(r"\[\d+\]$", "", name) for name in names if name not in taken)),
        wide=frozenset(name[: bracket.start()] for name in names if (bracket := re.search(r"\[\d+\]$", name))),
        time_unit="ns" if time and _is_stamp(_type_of_first(table, time[0])) else None,
    )


def group_of(name: str) -> str:
    """Return what a column's name begins with: `q` of `q.hip`, `q_0`, `q[0]` or `q` itself."""
    numbered = re.fullmatch(rf"([^.]*?){NUMBER}", name)
    return numbered[1] if numbered else name.partition(".")[0]


def _offers(names: Sequence[str]) -> Mapping[str, int]:
    return Counter(group_of(name) for name in names)


def _columns_of(
    channel: str, names: Sequence[str], settings: LogTable, usual: str, path: str
) -> tuple[tuple[str, ...] | None, list[str]]:
    """Return the labels and the names of a channel's columns, by its own or usual name, or as `[log]` asks."""
    asked = getattr(settings, channel).name
    if isinstance(asked, list):
        missing = [name for name in asked if name not in names]
        if missing:
            raise LogError(
                f"{path}: [log.{channel}] name asks for column {listed(missing)}; the file holds {listed(names)}"
            )
        return (tuple(asked) if channel in JOINT_CHANNELS else None), asked
    prefix = asked or usual
    matches = {name: match for name in names if (match := re.fullmatch(re.escape(prefix) + NUMBER, name))}
    dotted = [name for name in names if name.startswith(prefix + ".")]
    numbered = sorted((int(match[1] or match[2]), name) for name, match in matches.items())
    if channel == "time" or (asked in names and channel not in JOINT_CHANNELS):
        found = [prefix] if prefix in names else []
        labels: tuple[str, ...] | None = None
    elif numbered and set(dotted) <= set(matches):
        found = [name for _, name in numbered]
        labels = tuple(str(number) for number, _ in numbered)
    else:
        start = prefix + "." if dotted else prefix
        found = [name for name in names if name.startswith(start)] if asked or dotted else []
        labels = tuple(name.removeprefix(start) for name in found)
    if asked and not found:
        raise LogError(
            f"{path}: [log.{channel}] name asks for columns that begin with '{asked}'; the file holds {listed(names)}"
        )
    return labels, found


def _load(
    used: Mapping[str, list[str]], table: Table, notes: Sequence[str], wanted: Mapping[str, Sequence[int]]
) -> Loaded:
    """Return the wanted columns, copied batch by batch to where they belong, so that memory holds them once."""
    plan = {name: [used[name][index] if index >= 0 else "" for index in columns] for name, columns in wanted.items()}
    if table.on_disk:
        check_size(table.path, 8 * table.rows * sum(map(len, plan.values())))
    channels = {name: allocate((table.rows, len(names))) for name, names in plan.items() if name != "time"}
    columns = list(dict.fromkeys(name for names in plan.values() for name in names if name))
    free = {name for channel in ("time", "contact") for name in plan.get(channel, ())}
    stamps: list[NDArray[np.generic]] = []
    row = 0
    for batch in table.batches(columns, free):
        here = slice(row, row + batch.num_rows)
        row = here.stop
        for name, names in plan.items():
            if name == "time":
                stamps.append(_stamps(batch.column(names[0]), names[0], table.path))
                continue
            for place, column in enumerate(names):
                if column:
                    channels[name][here, place] = _numbers(batch.column(column), column, table.path)
    pa.default_memory_pool().release_unused()  # hundreds of megabytes that the stages after this one can use
    arrays: Arrays = {name: values[:row] for name, values in channels.items()}
    if "time" in plan:
        arrays["time"] = np.concatenate(stamps or [np.empty(0)])[:, None]
    return Loaded(arrays, tuple(notes))


def _is_stamp(kind: pa.DataType) -> bool:
    return bool(pa.types.is_timestamp(kind) or pa.types.is_duration(kind))


def _type_of_first(table: Table, column: str) -> pa.DataType:
    """Return the type of a column's first block; null if there is none."""
    return next((batch.schema.field(0).type for batch in table.batches([column], {column})), pa.null())


def _stamps(column: pa.Array, name: str, path: str) -> NDArray[np.generic]:
    """Return stamps as the file has them: integers stay integers, calendar times become nanoseconds."""
    if _is_stamp(column.type):
        column = column.cast(pa.timestamp("ns") if pa.types.is_timestamp(column.type) else pa.duration("ns"))
        column = column.cast(pa.int64())
    if pa.types.is_integer(column.type) and not column.null_count:
        return np.asarray(column.to_numpy(zero_copy_only=False), dtype=np.int64)
    return _numbers(column, name, path)


def _numbers(column: pa.Array, name: str, path: str) -> NDArray[np.float64]:
    """Return a column as float64, empty cells as NaN."""
    kind = column.type
    if pa.types.is_boolean(kind):
        column = column.cast(pa.int8())
    elif not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_null(kind)):
        raise LogError(f"{path}: column '{name}' holds values of type {kind}; expected numbers")
    return np.asarray(column.to_numpy(zero_copy_only=False), dtype=np.float64)
