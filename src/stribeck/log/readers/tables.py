"""Tables with one column per signal: `.csv` and `.parquet` files, and frames of pandas, polars and others in memory."""

import csv
import re
from collections.abc import Collection, Iterator
from functools import partial
from itertools import islice
from pathlib import Path

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from stribeck.errors import LogError
from stribeck.log.readers.columns import Table, is_list, numbers_in, source_of_columns, spread
from stribeck.log.readers.recording import Recording, foreign, listed
from stribeck.log.storage import BLOCK_ROWS
from stribeck.settings import LogTable

CSV_BLOCK = 1 << 23  # bytes parsed at once
HEAD = 64  # rows searched for the first list of a column


def open_parquet(path: Path, table: LogTable) -> Recording:
    """Open a Parquet file with columns `time`, `position.<joint>`, ...

    Raises
    ------
    LogError
        If it is damaged, lacks a column that `[log]` names, or contains other values than numbers in a used column.
    """
    return source_of_columns(parquet_table(path), table)


def open_csv(path: Path, table: LogTable) -> Recording:
    """Open a CSV file whose first line, or `[log] columns`, names the columns.

    They are separated by commas, semicolons, tabs or single spaces.

    Raises
    ------
    LogError
        As `open_parquet`, or if neither or both name the columns.
    """
    first, separator = first_line(path)
    if is_data(first) and not table.columns:
        raise LogError(
            f"{path}: the first line contains numbers ({listed(first, 3)}); expected a line of column names, or names "
            "of all columns in order as [log] columns"
        )
    if table.columns and not any(map(_is_number, first)):
        raise LogError(
            f"{path}: the first line names the columns ({listed(first, 3)}); remove [log] columns, which is for "
            "files without a header line"
        )
    if table.columns and len(first) != len(table.columns):
        raise LogError(
            f"{path}: the first line has {len(first)} values, but [log] columns has {len(table.columns)} names; "
            "expected one name per value, in order"
        )
    return source_of_columns(csv_table(path, table.columns or first, separator, not table.columns), table)


def parquet_table(path: Path) -> Table:
    """Open the table of a Parquet file."""
    # Without prefetching and with small buffers, a file with a single row group is not read into memory at once.
    bounds = {"pre_buffer": False, "buffer_size": 1 << 18}
    opened = partial(pyarrow.parquet.ParquetFile, path, page_checksum_verification=True, **bounds)

    def read(columns: list[str], _: Collection[str]) -> Iterator[pa.RecordBatch]:
        with foreign(str(path), "Parquet"), opened() as file:
            yield from file.iter_batches(BLOCK_ROWS, columns=columns)

    with foreign(str(path), "Parquet"), opened() as file:
        schema, rows = file.schema_arrow, file.metadata.num_rows
        lists = [one.name for one in schema if is_list(one.type)]
        head = next(file.iter_batches(HEAD, columns=lists), None) if lists else None
    names, places, widths = spread(schema.names, _measure_lists(head) if head else {})
    return Table(str(path), names, places, rows, read, lambda name: schema.field(name).type, widths)


def _measure_lists(head: pa.RecordBatch | pa.Table) -> dict[str, list[int]]:
    """Compute the sizes of the lists in some rows."""
    return {
        name: [len(one or ()) for one in column.to_pylist()]
        for name, column in zip(head.schema.names, head.columns, strict=True)
    }


def csv_table(path: Path, names: list[str], separator: str, named: bool) -> Table:
    """Open the table of a CSV file; `named` is whether its first line contains names."""
    with foreign(str(path), "CSV"), path.open("rb") as file:
        rows = sum(block.count(b"\n") for block in iter(partial(file.read, CSV_BLOCK), b"")) + 1
    with foreign(str(path), "CSV"), path.open(encoding="utf-8-sig", errors="replace", newline="") as text:
        records = csv.reader(text, delimiter=separator, skipinitialspace=True)
        head = list(islice((cells for cells in islice(records, int(named), None) if cells), HEAD))
    first = head[0] if head else []
    lists = {name: k for k, (name, cell) in enumerate(zip(names, first, strict=False)) if cell.strip().startswith("[")}
    number = re.compile(r"\s*[+-]?\d+,\d+([eE][+-]?\d+)?\s*")  # decimal comma of German and French programs
    comma = separator != "," and any(map(number.fullmatch, first))
    # Errors name their row only without threads, which are no faster here.
    reading = pyarrow.csv.ReadOptions(column_names=names, skip_rows=int(named), block_size=CSV_BLOCK, use_threads=False)
    parsing = pyarrow.csv.ParseOptions(delimiter=separator, newlines_in_values=bool(lists))

    def converting(columns: list[str], free: Collection[str]) -> pyarrow.csv.ConvertOptions:
        return pyarrow.csv.ConvertOptions(
            include_columns=columns,
            decimal_point="," if comma else ".",
            true_values=[blank + word for blank in ("", " ") for word in ("true", "True", "TRUE")],
            false_values=[blank + word for blank in ("", " ") for word in ("false", "False", "FALSE")],
            column_types={name: pa.float64() for name in columns if name not in free}
            | {name: pa.string() for name in columns if name in lists},
        )

    def read(columns: list[str], free: Collection[str]) -> Iterator[pa.RecordBatch]:
        with foreign(str(path), "CSV"):
            yield from pyarrow.csv.open_csv(path, reading, parsing, converting(columns, free))

    def kind(name: str) -> pa.DataType:
        return next((batch.schema.field(0).type for batch in read([name], {name})), pa.null())

    sizes = {
        name: [len(numbers_in(cells[k], row, name, str(path))) for row, cells in enumerate(head, 1) if k < len(cells)]
        for name, k in lists.items()
    }
    spread_names, places, widths = spread(names, sizes)
    return Table(str(path), spread_names, places, rows, read, kind, widths)


def first_line(path: Path) -> tuple[list[str], str]:
    """Split the first line of a CSV file, and detect its separator."""
    with foreign(str(path), "CSV"), path.open("rb") as file:
        line, second = (file.readline(1 << 20).decode("utf-8-sig").strip() for _ in range(2))
        line = line.removeprefix("#").lstrip()
        bare = re.sub(r'"[^"]*"|\[[^]]*\]', "x", line)
        separator = max(",;\t", key=bare.count)
        if separator not in bare and (not second or bare.count(" ") == second.count(" ")):  # else one name, `Time (s)`
            separator = " "
        cells = csv.reader([line], delimiter=separator, skipinitialspace=True)
        names = [name.strip() for name in next(cells, [])]
    if not names:
        raise LogError(f"{path}: is empty; expected a line of column names, then one line per sample")
    return names, separator


def is_data(cells: list[str]) -> bool:
    """Return whether a line contains values instead of names."""
    return any(map(_is_number, cells)) and all(not cell or _is_number(cell) for cell in cells)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return cell.startswith("[") and cell.endswith("]")
    return True


def table_of_frame(frame: object) -> Table:
    """Open the table of a frame; a named index is a column too.

    Raises
    ------
    LogError
        If it is no frame, or has columns that Arrow cannot represent.
    """
    if not hasattr(frame, "__arrow_c_stream__"):
        raise LogError(
            f"frame: is of type '{type(frame).__name__}'; expected a table of pandas, polars or another library with "
            "the Arrow interface (__arrow_c_stream__)"
        )
    with foreign("frame", "a table"):
        data = pa.table(frame)
        lists = [one.name for one in data.schema if is_list(one.type)]
        names, places, widths = spread(data.column_names, _measure_lists(data.select(lists).slice(0, HEAD)))

    def read(columns: list[str], _: Collection[str]) -> Iterator[pa.RecordBatch]:
        with foreign("frame", "a table"):
            yield from data.select(columns).to_batches(max_chunksize=BLOCK_ROWS)

    return Table("frame", names, places, len(data), read, lambda name: data.schema.field(name).type, widths, False)
