"""Files with a column a signal: `.csv` and `.parquet`."""

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
from stribeck.log.readers.columns import Table, source_of_columns
from stribeck.log.readers.lists import is_list, spread
from stribeck.log.readers.source import Source, foreign, listed
from stribeck.log.storage import BLOCK_ROWS
from stribeck.settings import LogTable

CSV_BLOCK = 1 << 23  # bytes parsed at once
PARQUET_BUFFER = 1 << 18  # bytes read ahead of each column
LONGEST_HEADER = 1 << 20  # bytes; the names of ten thousand columns
SEPARATORS = ",;\t"
DECIMAL_COMMA = re.compile(r"\s*[+-]?\d+,\d+([eE][+-]?\d+)?\s*")
"""A number as German and French programs write it."""


def open_parquet(path: Path, table: LogTable) -> Source:
    """Open a Parquet file with columns `time`, `position.<joint>`, ...; it is read batch by batch.

    Raises
    ------
    LogError
        If it is damaged, lacks a column that `[log]` names, or holds anything but numbers in a column that is used.
    """
    return source_of_columns(parquet_table(path), table)


def open_csv(path: Path, table: LogTable) -> Source:
    """Open a CSV file whose first line, or `[log] columns`, names the columns.

    Commas, semicolons or tabs separate them, or else single spaces.

    Raises
    ------
    LogError
        As `open_parquet`, or if nothing names the columns, or both do.
    """
    first, separator = first_line(path)
    if is_data(first) and not table.columns:
        raise LogError(
            f"{path}: the first line holds numbers ({listed(first, 3)}); expected a line of column names, or the names "
            "of all columns in order as [log] columns"
        )
    if table.columns and not any(map(_is_number, first)):
        raise LogError(
            f"{path}: the first line names the columns ({listed(first, 3)}), and so does [log] columns; expected one "
            "of them: [log] columns is for files without a line of names"
        )
    if table.columns and len(first) != len(table.columns):
        raise LogError(
            f"{path}: the first line has {len(first)} values, and [log] columns has {len(table.columns)} names; "
            "expected a name for each, in order"
        )
    return source_of_columns(csv_table(path, table.columns or first, separator, not table.columns), table)


def parquet_table(path: Path) -> Table:
    """Return the table of a Parquet file."""

    def batches(columns: list[str], _: Collection[str]) -> Iterator[pa.RecordBatch]:
        # Without prefetching and with small buffers, a file that is one row group does not enter memory whole.
        with (
            foreign(str(path), "Parquet"),
            pyarrow.parquet.ParquetFile(
                path, pre_buffer=False, buffer_size=PARQUET_BUFFER, page_checksum_verification=True
            ) as file,
        ):
            yield from file.iter_batches(BLOCK_ROWS, columns=columns)

    with foreign(str(path), "Parquet"), pyarrow.parquet.ParquetFile(path) as file:
        schema, rows = file.schema_arrow, file.metadata.num_rows
    table = Table(str(path), list(schema.names), rows, batches)
    return spread(table, {field.name for field in schema if is_list(field.type)})


def csv_table(path: Path, names: list[str], separator: str, named: bool) -> Table:
    """Return the table of a CSV file; its first line is of names, if it is `named`."""
    with foreign(str(path), "CSV"), path.open("rb") as file:
        rows = sum(block.count(b"\n") for block in iter(partial(file.read, CSV_BLOCK), b"")) + 1
    with foreign(str(path), "CSV"), path.open(encoding="utf-8-sig", newline="") as text:
        records = csv.reader(text, delimiter=separator, skipinitialspace=True)
        cells = next((cells for cells in islice(records, int(named), None) if cells), [])
    lists = {name for name, cell in zip(names, cells, strict=False) if cell.strip().startswith("[")}
    comma = separator != "," and any(map(DECIMAL_COMMA.fullmatch, cells))

    def batches(columns: list[str], free: Collection[str]) -> Iterator[pa.RecordBatch]:
        with foreign(str(path), "CSV"):
            yield from pyarrow.csv.open_csv(
                path,
                read_options=pyarrow.csv.ReadOptions(  # errors name their row only without threads, which gain nothing
                    column_names=names, skip_rows=int(named), block_size=CSV_BLOCK, use_threads=False
                ),
                parse_options=pyarrow.csv.ParseOptions(delimiter=separator, newlines_in_values=bool(lists)),
                convert_options=pyarrow.csv.ConvertOptions(
                    include_columns=columns,
                    decimal_point="," if comma else ".",
                    true_values=[blank + word for blank in ("", " ") for word in ("true", "True", "TRUE")],
                    false_values=[blank + word for blank in ("", " ") for word in ("false", "False", "FALSE")],
                    column_types={name: pa.float64() for name in columns if name not in free}
                    | {name: pa.string() for name in columns if name in lists},
                ),
            )

    return spread(Table(str(path), names, rows, batches), lists)


def first_line(path: Path) -> tuple[list[str], str]:
    """Return the cells of a CSV file's first line, and what separates them."""
    with foreign(str(path), "CSV"), path.open("rb") as file:
        line, second = (file.readline(LONGEST_HEADER).decode("utf-8-sig").strip() for _ in range(2))
        line = line.removeprefix("#").lstrip()
        bare = re.sub(r'"[^"]*"|\[[^]]*\]', "x", line)
        separator = max(SEPARATORS, key=bare.count)
        if separator not in bare and (not second or bare.count(" ") == second.count(" ")):  # else one name, `Time (s)`
            separator = " "
        cells = csv.reader([line], delimiter=separator, skipinitialspace=True)
        names = [name.strip() for name in next(cells, [])]
    if not names:
        raise LogError(f"{path}: is empty; expected a line of column names, then one line a sample")
    return names, separator


def is_data(cells: list[str]) -> bool:
    """Return whether a line holds values and no names."""
    return any(map(_is_number, cells)) and all(not cell or _is_number(cell) for cell in cells)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return cell.startswith("[") and cell.endswith("]")
    return True
