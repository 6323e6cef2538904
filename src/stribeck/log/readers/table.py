"""Tables with a column a signal: `.csv` and `.parquet`."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from numpy.typing import NDArray

from stribeck.errors import LogError
from stribeck.log.readers.source import CHANNELS, JOINT_CHANNELS, Arrays, Channel, Loaded, Source, foreign, listed
from stribeck.log.storage import BLOCK_ROWS, allocate, check_size
from stribeck.settings import LogTable

Batches = Callable[[list[str]], Iterator[pa.RecordBatch]]
CSV_BLOCK = 1 << 23  # bytes parsed at once
PARQUET_BUFFER = 1 << 18  # bytes read ahead of each column
LONGEST_HEADER = 1 << 20  # bytes; the names of ten thousand columns
SEPARATORS = ",;\t"


def open_parquet(path: Path, table: LogTable) -> Source:
    """Open a Parquet file with columns `time`, `position.<joint>`, ...; it is read batch by batch.

    Raises
    ------
    LogError
        If it is damaged, lacks a column that `[log]` names, or holds anything but numbers in a column that is used.
    """

    def batches(columns: list[str]) -> Iterator[pa.RecordBatch]:
        # Without prefetching and with small buffers, a file that is one row group does not enter memory whole.
        with (
            foreign(str(path), "Parquet"),
            pyarrow.parquet.ParquetFile(
                path, pre_buffer=False, buffer_size=PARQUET_BUFFER, page_checksum_verification=True
            ) as file,
        ):
            yield from file.iter_batches(BLOCK_ROWS, columns=columns)

    with foreign(str(path), "Parquet"), pyarrow.parquet.ParquetFile(path) as file:
        names, rows = list(file.schema_arrow.names), file.metadata.num_rows
        nanoseconds = any(field.name == _time_column(table) and _is_stamp(field.type) for field in file.schema_arrow)
    return _source_of_columns(str(path), names, rows, batches, table, nanoseconds)


def open_csv(path: Path, table: LogTable) -> Source:
    """Open a CSV file whose first line names the columns; commas, semicolons or tabs separate them.

    Raises
    ------
    LogError
        As `open_parquet`.
    """
    with foreign(str(path), "CSV"), path.open("rb") as file:
        header = file.readline(LONGEST_HEADER).decode("utf-8-sig").strip()
        rows = sum(block.count(b"\n") for block in iter(partial(file.read, CSV_BLOCK), b"")) + 1
        separator = max(SEPARATORS, key=header.count)
        cells = csv.reader([header.removeprefix("#")], delimiter=separator, skipinitialspace=True)
        names = [name.strip() for name in next(cells, [])]
    if not header or not rows:
        raise LogError(f"{path}: is empty; expected a line of column names, then one line a sample")
    inferred = {_time_column(table), *_columns_of("contact", names, table, str(path))[1]}  # integers, dates, booleans

    def batches(columns: list[str]) -> Iterator[pa.RecordBatch]:
        with foreign(str(path), "CSV"):
            yield from pyarrow.csv.open_csv(
                path,
                read_options=pyarrow.csv.ReadOptions(  # errors name their row only without threads, which gain nothing
                    column_names=names, skip_rows=1, block_size=CSV_BLOCK, use_threads=False
                ),
                parse_options=pyarrow.csv.ParseOptions(delimiter=separator),
                convert_options=pyarrow.csv.ConvertOptions(
                    include_columns=columns,
                    true_values=[blank + word for blank in ("", " ") for word in ("true", "True", "TRUE")],
                    false_values=[blank + word for blank in ("", " ") for word in ("false", "False", "FALSE")],
                    column_types={name: pa.float64() for name in columns if name not in inferred},
                ),
            )

    stamps = _time_column(table) in names and _is_stamp(_type_of_first(batches, _time_column(table)))
    return _source_of_columns(str(path), names, rows, batches, table, stamps)


def _time_column(table: LogTable) -> str:
    name = table.time.name
    return name if isinstance(name, str) else (name[0] if name else "time")


def _is_stamp(kind: pa.DataType) -> bool:
    return bool(pa.types.is_timestamp(kind) or pa.types.is_duration(kind))


def _type_of_first(batches: Batches, column: str) -> pa.DataType:
    """Return the type of a column's first block; null if there is none."""
    return next((batch.schema.field(0).type for batch in batches([column])), pa.null())


def _source_of_columns(
    path: str, names: list[str], rows: int, batches: Batches, table: LogTable, nanoseconds: bool
) -> Source:
    used = {channel: _columns_of(channel, names, table, path) for channel in CHANNELS}
    twice = [name for name, count in Counter(names).items() if count > 1]
    clash = sorted({name for _, columns in used.values() for name in columns if name in twice})
    if clash:
        raise LogError(f"{path}: holds column {listed(clash)} more than once; expected one column a name")
    taken = {name for _, columns in used.values() for name in columns}
    return Source(
        path=path,
        channels={name: Channel(len(columns), labels) for name, (labels, columns) in used.items() if columns},
        load=partial(_load, {name: columns for name, (_, columns) in used.items()}, rows, batches, path),
        others=tuple(name for name in names if name not in taken),
        time_unit="ns" if nanoseconds else None,
    )


def _columns_of(channel: str, names: list[str], table: LogTable, path: str) -> tuple[tuple[str, ...] | None, list[str]]:
    """Return the labels and the names of a channel's columns: `<channel>.<label>`, or as `[log]` asks."""
    asked = getattr(table, channel).name
    if isinstance(asked, list):
        missing = [name for name in asked if name not in names]
        if missing:
            raise LogError(
                f"{path}: [log.{channel}] name asks for column {listed(missing)}; the file holds {listed(names)}"
            )
        return (tuple(asked) if channel in JOINT_CHANNELS else None), asked
    prefix = asked or channel
    if channel == "time" or (asked in names and channel not in JOINT_CHANNELS):
        found = [prefix] if prefix in names else []
        labels: tuple[str, ...] | None = None
    else:
        start = prefix + "." if any(name.startswith(prefix + ".") for name in names) else prefix
        found = [name for name in names if name.startswith(start)] if asked or start.endswith(".") else []
        labels = tuple(name.removeprefix(start) for name in found)
    if asked and not found:
        raise LogError(
            f"{path}: [log.{channel}] name asks for columns that begin with '{asked}'; the file holds {listed(names)}"
        )
    return labels, found


def _load(
    used: Mapping[str, list[str]], rows: int, batches: Batches, path: str, wanted: Mapping[str, Sequence[int]]
) -> Loaded:
    """Return the wanted columns, copied batch by batch to where they belong, so that memory holds them once."""
    plan = {name: [used[name][index] if index >= 0 else "" for index in columns] for name, columns in wanted.items()}
    check_size(path, 8 * rows * sum(map(len, plan.values())))
    channels = {name: allocate((rows, len(columns))) for name, columns in plan.items() if name != "time"}
    stamps: list[NDArray[np.generic]] = []
    row = 0
    for batch in batches(list(dict.fromkeys(name for columns in plan.values() for name in columns if name))):
        here = slice(row, row + batch.num_rows)
        row = here.stop
        for name, columns in plan.items():
            if name == "time":
                stamps.append(_stamps(batch.column(columns[0]), columns[0], path))
                continue
            for place, column in enumerate(columns):
                if column:
                    channels[name][here, place] = _numbers(batch.column(column), column, path)
    pa.default_memory_pool().release_unused()  # hundreds of megabytes that the stages after this one can use
    arrays: Arrays = {name: values[:row] for name, values in channels.items()}
    return Loaded(arrays | ({"time": np.concatenate(stamps or [np.empty(0)])[:, None]} if "time" in plan else {}))


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
