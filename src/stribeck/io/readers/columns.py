"""Assignment of a table's columns to channels, and their values."""

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import pyarrow as pa
import pyarrow.compute
from numpy.typing import NDArray

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.errors import LogError, listed
from stribeck.core.log.channels import CHANNELS, JOINT_CHANNELS
from stribeck.core.log.storage import allocate, check_size
from stribeck.core.settings import LogTable
from stribeck.io.readers.mapping import alias_note, find_aliases, resample
from stribeck.io.readers.recording import Arrays, Channel, Loaded, Recording, Wanted

NUMBER = r"[._]?(?:(\d+)|\[(\d+)\])"
"""Suffix of numbered columns: `q_0`, `q0`, `q.0`, `q[0]`."""
STAMP = re.compile(r"(?i)(.*[._])?(sec|nanosec|secs|nsecs|nsec|seconds|nanoseconds)")
"""Two columns of a stamp in ROS, `header.stamp.sec` and `header.stamp.nanosec`, in this order."""


@dataclass(frozen=True)
class OpenedTable:
    """Opened table.

    Attributes
    ----------
    path
        Path of the file, for messages.
    names
        Column names; a column `q` with a list in every row counts as `q[0]`, `q[1]`, ...
    places
        {name: column in the file, index in its list or None}.
    rows
        Upper bound of the number of rows.
    read
        Function that reads columns of the file in batches. Columns in its second argument may be flags or dates instead
        of floating-point numbers.
    kind
        Function that returns the type of a column of the file.
    widths
        {column in the file: values in each of its lists}.
    on_disk
        Whether `path` is a file, whose size limits its content.
    """

    path: str
    names: list[str]
    places: Mapping[str, tuple[str, int | None]]
    rows: int
    read: Callable[[list[str], Collection[str]], Iterator[pa.RecordBatch]]
    kind: Callable[[str], pa.DataType]
    widths: Mapping[str, int] = field(default_factory=dict)
    on_disk: bool = True


def spread(
    names: Sequence[str], first: Mapping[str, Sequence[int]]
) -> tuple[list[str], dict[str, tuple[str, int | None]], dict[str, int]]:
    """Compute names, places and widths of an `OpenedTable`, given the sizes of the first lists in columns of lists.

    Columns with more than 1000 values per row contain images or the like, and are not spread.
    """
    widths = {name: next((size for size in sizes if size), 0) for name, sizes in first.items()}
    widths = {name: width for name, width in widths.items() if 0 < width <= 1000}
    columns: list[tuple[str, str, int | None]] = []
    for name in names:
        columns += [(f"{name}[{k}]", name, k) for k in range(widths[name])] if name in widths else [(name, name, None)]
    return [name for name, _, _ in columns], {name: (column, k) for name, column, k in columns}, widths


def is_list(kind: pa.DataType) -> bool:
    """Return whether a column of this type has a list of numbers in every row."""
    of_lists = pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind)
    return bool(of_lists and (pa.types.is_floating(kind.value_type) or pa.types.is_integer(kind.value_type)))


def source_of_columns(table: OpenedTable, settings: LogTable, notes: Sequence[str] = ()) -> Recording:
    """Make the recording of a table whose columns are named `<channel>.<label>`, numbered, or named in `[log]`.

    The notes follow those on alternative names.

    Raises
    ------
    LogError
        If a column that `[log]` names is missing, or a used column name is not unique.
    """
    path, names = table.path, table.names
    aliases = find_aliases(settings, Counter(group_of(name) for name in names))
    used = {channel: _columns_of(channel, names, settings, aliases.get(channel, channel), path) for channel in CHANNELS}
    for channel in ("velocity", "acceleration", "temperature"):  # numbered joints need as many positions
        labels, columns = used[channel]
        if labels and labels[0].isdecimal() and len(columns) != len(used["position"][1]):
            used[channel] = (None, [])
    taken = {name for _, columns in used.values() for name in columns}
    if clash := sorted(taken & {name for name, count in Counter(names).items() if count > 1}):
        raise LogError(f"{path}: contains column {listed(clash)} more than once; expected unique names")
    time, notes = used["time"][1], [*alias_note(aliases), *notes]
    return Recording(
        path=path,
        channels={name: Channel(len(columns), labels) for name, (labels, columns) in used.items() if columns},
        load=partial(_load, {name: columns for name, (_, columns) in used.items()}, table, notes),
        others=tuple(dict.fromkeys(re.sub(r"\[\d+\]$", "", name) for name in names if name not in taken)),
        wide=frozenset(name[: bracket.start()] for name in names if (bracket := re.search(r"\[\d+\]$", name))),
        time_unit="ns" if len(time) > 1 or (time and _is_stamp(table.kind(table.places[time[0]][0]))) else None,
    )


def group_of(name: str) -> str:
    """Return the start of a column's name: `q` of `q.hip`, `q_0`, `q[0]` or `q` itself."""
    numbered = re.fullmatch(rf"([^.]*?){NUMBER}", name)
    return numbered[1] if numbered else name.partition(".")[0]


def _columns_of(
    channel: str, names: Sequence[str], settings: LogTable, usual: str, path: str
) -> tuple[tuple[str, ...] | None, list[str]]:
    """Find labels and names of a channel's columns, by its standard or alternative name, or as `[log]` names them."""
    asked = getattr(settings, channel).name
    if isinstance(asked, list):
        if missing := [name for name in asked if name not in names]:
            raise LogError(f"{path}: [log.{channel}] name lists column {listed(missing)}; the file has {listed(names)}")
        return (tuple(asked) if channel in JOINT_CHANNELS else None), asked
    prefix = asked or usual
    matches = {name: match for name in names if (match := re.fullmatch(re.escape(prefix) + NUMBER, name))}
    dotted = [name for name in names if name.startswith(prefix + ".")]
    numbered = sorted((int(match[1] or match[2]), name) for name, match in matches.items())
    if channel == "time" or (asked in names and channel not in JOINT_CHANNELS):
        stamps = [name for name in names if STAMP.fullmatch(name)] if channel == "time" and not asked else []
        columns = [prefix] if prefix in names else stamps * (len(stamps) == 2)
        labels: tuple[str, ...] | None = None
    elif numbered and set(dotted) <= set(matches):
        columns = [name for _, name in numbered]
        labels = tuple(str(number) for number, _ in numbered)
    else:
        start = prefix + "." if dotted else prefix
        columns = [name for name in names if name.startswith(start)] if asked or dotted else []
        labels = tuple(name.removeprefix(start) for name in columns)
    if asked and not columns:
        raise LogError(
            f"{path}: [log.{channel}] name is '{asked}', but no column starts with it; the file has {listed(names)}"
        )
    return labels, columns


def _load(used: Mapping[str, list[str]], table: OpenedTable, notes: Sequence[str], wanted: Wanted) -> Loaded:
    """Read columns, batch by batch, directly into their arrays to save memory."""
    wanted = {name: range(len(used[name])) if name == "time" else order for name, order in wanted.items()}
    plan = {name: [table.places[used[name][k]] if k >= 0 else None for k in order] for name, order in wanted.items()}
    if table.on_disk:
        check_size(table.path, 8 * table.rows * sum(map(len, plan.values())))
    stored = list(dict.fromkeys(place[0] for places in plan.values() for place in places if place))
    free = {place[0] for channel in ("time", "contact") for place in plan.get(channel, ()) if place}
    channels = {name: allocate((table.rows, len(places))) for name, places in plan.items() if name != "time"}
    stamps: list[NDArray[np.generic]] = []
    row = 0
    for batch in table.read(stored, free):
        rows = slice(row, row + batch.num_rows)
        lists = {
            name: _stack_lists(batch.column(name), table.widths[name], row, name, table.path)
            for name in stored
            if name in table.widths
        }
        for channel, places in plan.items():
            for k, (name, place) in ((k, at) for k, at in enumerate(places) if at):
                if place is not None:
                    values: NDArray[np.generic] = lists[name][:, place]
                else:
                    values = (_read_stamps if channel == "time" else _to_float)(batch.column(name), name, table.path)
                if channel == "time":
                    stamps.append(values)
                else:
                    channels[channel][rows, k] = values
        row = rows.stop
    pa.default_memory_pool().release_unused()  # hundreds of megabytes for later stages
    arrays: Arrays = {name: values[:row] for name, values in channels.items()}
    if "time" not in plan:
        return arrays, list(notes)
    arrays["time"] = np.concatenate(stamps[:: len(plan["time"])] or [np.empty(0)])[:, None]
    if len(plan["time"]) > 1:  # seconds and nanoseconds
        arrays["time"] = 10**9 * arrays["time"] + np.concatenate(stamps[1::2])[:, None]
    return _on_one_clock(arrays, notes)


def _on_one_clock(arrays: Arrays, notes: Sequence[str]) -> Loaded:
    """Interpolate columns that have their own rows, as topics do that share a table, to the rows of the positions.

    Values farther apart than three of their periods stay missing between them.
    """
    known = {name: np.isfinite(values) for name, values in arrays.items() if name != "time"}
    stamps = arrays["time"].ravel()
    if "position" not in known or not np.isfinite(stamps.astype(np.float64)).all():
        return arrays, list(notes)
    lead = known["position"].all(axis=1)
    apart = [
        name  # and not much slower than the positions, as `join` requires too
        for name, mask in known.items()
        if lead.any() and np.mean(mask[lead]) < 0.5 and np.all(mask.sum(axis=0) > lead.sum() / 10)
    ]
    if not apart:
        return arrays, list(notes)
    time = (stamps - stamps[0]).astype(np.float64)
    result: Arrays = {name: values[lead] for name, values in arrays.items()}
    for name in apart:
        for column, rows in zip(range(arrays[name].shape[1]), known[name].T, strict=True):
            times, values = time[rows], np.asarray(arrays[name], dtype=np.float64)[rows, column, None]
            if len(times) > 1:
                longest = 3 * float(np.median(np.diff(times)))
                result[name][:, column] = resample(name, time[lead], times, values, longest)[:, 0]
    return result, [*notes, f"Interpolated to the {lead.sum()} rows with positions: {', '.join(apart)}."]


def _stack_lists(column: pa.Array, width: int, row: int, name: str, path: str) -> Array:
    """Convert lists to an array (rows, width) with NaN for missing ones; `row` is the number of the first row."""
    sizes, flat = _split_cells(column, row, name, path)
    uneven = np.flatnonzero((sizes != width) & (sizes != 0))
    if uneven.size:
        raise LogError(
            f"{path}: column '{name}' contains {sizes[uneven[0]]} values in row {row + uneven[0] + 1}, {width} before; "
            "expected the same number in every row"
        )
    values = np.full((len(column), width), np.nan)
    values[sizes > 0] = flat.reshape(-1, width)
    return values


def _split_cells(column: pa.Array, row: int, name: str, path: str) -> tuple[IntArray, Array]:
    """Count the values of each cell, 0 for an empty one, and concatenate all values."""
    if pa.types.is_string(column.type):
        texts = [numbers_in(text, row + k, name, path) for k, text in enumerate(column.to_pylist(), 1)]
        return np.array([len(text) for text in texts], dtype=np.int64), np.concatenate([np.zeros(0), *texts])
    sizes = pyarrow.compute.fill_null(pyarrow.compute.list_value_length(column), 0)
    flat = np.asarray(column.flatten().to_numpy(zero_copy_only=False), dtype=np.float64)
    return np.asarray(sizes.to_numpy(zero_copy_only=False), dtype=np.int64), flat


def numbers_in(text: str | None, row: int, name: str, path: str) -> Array:
    """Parse the numbers of a cell like `[1.0, 2.0]`, separated by commas or blanks."""
    if not text or not text.strip():
        return np.zeros(0)
    inner = text.strip()
    try:
        if not (inner.startswith("[") and inner.endswith("]")):
            raise ValueError
        return np.array(inner[1:-1].replace(",", " ").split(), dtype=np.float64)
    except ValueError as error:
        raise LogError(
            f"{path}: column '{name}' contains '{inner[:40]}' in row {row}; expected a list of numbers like [1.0, 2.0]"
        ) from error


def _is_stamp(kind: pa.DataType) -> bool:
    return bool(pa.types.is_timestamp(kind) or pa.types.is_duration(kind))


def _read_stamps(column: pa.Array, name: str, path: str) -> NDArray[np.generic]:
    """Read stamps without loss: integers stay integers, calendar times become nanoseconds."""
    if _is_stamp(column.type):
        column = column.cast(pa.timestamp("ns") if pa.types.is_timestamp(column.type) else pa.duration("ns"))
        column = column.cast(pa.int64())
    if pa.types.is_integer(column.type) and not column.null_count:
        return np.asarray(_to_array(column), dtype=np.int64)
    return _to_float(column, name, path)


def _to_float(column: pa.Array, name: str, path: str) -> Array:
    """Convert a column to float64, with NaN for empty cells."""
    kind = column.type
    if pa.types.is_boolean(kind):
        column = column.cast(pa.int8())
    elif not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_null(kind)):
        raise LogError(f"{path}: column '{name}' contains values of type {kind}; expected numbers")
    return np.asarray(_to_array(column), dtype=np.float64)


def _to_array(column: pa.Array) -> NDArray[np.generic]:
    """Convert numbers to an array; `to_numpy` imports pandas, which takes longer than reading most logs."""
    if column.null_count or pa.types.is_null(column.type):
        return np.asarray(column.to_numpy(zero_copy_only=False))
    return np.from_dlpack(column)
