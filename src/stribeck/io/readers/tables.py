"""Tables with one column per signal: files of text and of Arrow, and frames of pandas, polars and others in memory."""

import codecs
import csv
import gzip
import io
import json
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.feather
import pyarrow.json
import pyarrow.parquet

from stribeck.core.errors import LogError, listed
from stribeck.core.log.storage import BLOCK_ROWS
from stribeck.core.settings import LogTable
from stribeck.io.readers.columns import OpenedTable, is_list, numbers_in, source_of_columns, spread
from stribeck.io.readers.recording import Recording, foreign

CSV_BLOCK = 1 << 23  # bytes parsed at once
HEAD = 64  # rows searched for the first values, and for the first list of a column
COMMENT = re.compile(r"#+\s*|%+\s+")


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
    layout = find_layout(path)
    first = layout.cells
    if is_data(first) and not table.columns:
        raise LogError(
            f"{path}: the first line contains numbers ({listed(first, 3)}); expected a line of column names, or names "
            "of all columns in order as [log] columns"
        )
    if table.columns and not (any(map(_is_number, first)) and len(first) == len(table.columns)):
        raise LogError(
            f"{path}: the first line has {listed(first, 3)}, and [log] columns has {len(table.columns)} names; "
            "expected as many values as names, or no [log] columns for a file with a line of names"
        )
    return source_of_columns(csv_table(path, table.columns or first, layout), table)


def parquet_table(path: Path) -> OpenedTable:
    """Open the table of a Parquet file."""
    # Without prefetching and with small buffers, a file with a single row group is not read into memory at once.
    bounds = {"pre_buffer": False, "buffer_size": 1 << 18}
    opened = partial(pyarrow.parquet.ParquetFile, path, page_checksum_verification=True, **bounds)

    def read(columns: list[str], _: Collection[str]) -> Iterator[pa.RecordBatch]:
        with foreign(str(path), "Parquet"), opened() as file:
            yield from file.iter_batches(BLOCK_ROWS, columns=columns)

    with foreign(str(path), "Parquet"), opened() as file:
        schema, rows = file.schema_arrow, file.metadata.num_rows
        lists = [field.name for field in schema if is_list(field.type)]
        head = next(file.iter_batches(HEAD, columns=lists), None) if lists else None
    names, places, widths = spread(schema.names, _measure_lists(head) if head else {})
    return OpenedTable(str(path), names, places, rows, read, lambda name: schema.field(name).type, widths)


def _measure_lists(head: pa.RecordBatch | pa.Table) -> dict[str, list[int]]:
    """Compute the sizes of the lists in some rows."""
    return {
        name: [len(values or ()) for values in column.to_pylist()]
        for name, column in zip(head.schema.names, head.columns, strict=True)
    }


@dataclass(frozen=True)
class CsvLayout:
    """Cells of the line of names, or of the first line of values if there is none, and how to read the other lines."""

    cells: list[str]
    separator: str
    skipped: int  # lines before the first values
    encoding: str


def csv_table(path: Path, names: list[str], layout: CsvLayout) -> OpenedTable:
    """Open the table of a CSV file."""
    rows, commas, separator = 1, False, layout.separator
    with foreign(str(path), "CSV"), _open(path) as file:
        for block in iter(partial(file.read, CSV_BLOCK), b""):
            rows += block.count(b"\n")
            commas = commas or re.search(rb"\d,\d", block.replace(b"\0", b"")) is not None
    with foreign(str(path), "CSV"), _open(path) as file:
        text = io.TextIOWrapper(file, layout.encoding, errors="replace", newline="")
        records = csv.reader(islice(text, layout.skipped, None), delimiter=separator, skipinitialspace=True)
        head = list(islice((cells for cells in records if cells), HEAD))
    first = head[0] if head else []
    lists = {name: k for k, (name, cell) in enumerate(zip(names, first, strict=False)) if cell.strip().startswith("[")}
    comma = separator != "," and commas and not lists  # of German and French programs
    # Errors name their row only without threads, which are no faster here.
    reading = pyarrow.csv.ReadOptions(
        column_names=names,
        skip_rows=layout.skipped,
        block_size=CSV_BLOCK,
        use_threads=False,
        encoding=layout.encoding.replace("utf-8-sig", "utf-8"),
    )
    parsing = pyarrow.csv.ParseOptions(delimiter=separator, newlines_in_values=bool(lists))

    def read(columns: list[str], free: Collection[str]) -> Iterator[pa.RecordBatch]:
        converting = pyarrow.csv.ConvertOptions(
            include_columns=columns,
            decimal_point="," if comma else ".",
            true_values=[blank + word for blank in ("", " ") for word in ("true", "True", "TRUE")],
            false_values=[blank + word for blank in ("", " ") for word in ("false", "False", "FALSE")],
            column_types={name: pa.float64() for name in columns if name not in free}
            | {name: pa.string() for name in columns if name in lists},
        )
        with foreign(str(path), "CSV"):
            yield from pyarrow.csv.open_csv(path, reading, parsing, converting)

    def kind(name: str) -> pa.DataType:
        return next((batch.schema.field(0).type for batch in read([name], {name})), pa.null())

    sizes = {
        name: [len(numbers_in(cells[k], row, name, str(path))) for row, cells in enumerate(head, 1) if k < len(cells)]
        for name, k in lists.items()
    }
    spread_names, places, widths = spread(names, sizes)
    return OpenedTable(str(path), spread_names, places, rows, read, kind, widths)


def _open(path: Path) -> gzip.GzipFile | io.BufferedReader:
    """Open a file of text, which may be compressed."""
    return gzip.open(path) if path.suffix.lower() == ".gz" else path.open("rb")


def find_layout(path: Path) -> CsvLayout:
    """Find the line of names of a CSV file, after comments and before units, its separator and its encoding.

    Units other than SI are appended to the names, for `init`: `position [deg]`.
    """
    # Cells of a line of units.
    of_units = re.compile(r"[\[({]?[A-Za-z°µ%]{0,4}([/*· ]?[A-Za-z]{0,3}[²^2]{0,2})[\])}]?|[-1]?|\[-\]|turns?|degrees?")
    # Units in which columns are read by default, in small letters.
    si = {"", "-", "1", "s", "rad", "rad/s", "rad/s^2", "rad/s²", "nm", "n m", "n*m", "n·m", "n", "m", "m/s", "m/s²"}
    with foreign(str(path), "CSV"), _open(path) as file:
        start = file.read(1 << 20)
    encoding = "utf-8-sig"
    if start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        encoding = "utf-16"
    else:
        try:
            codecs.getincrementaldecoder("utf-8")().decode(start)
        except UnicodeDecodeError:
            encoding = "latin-1"
    lines = [line.strip() for line in start.decode(encoding, errors="replace").splitlines()[:HEAD]]
    bare = [re.sub(r'"[^"]*"|\[[^]]*\]', "x", COMMENT.sub("", line)) for line in lines]
    separators = [next((separator for separator in ";\t," if separator in line), " ") for line in bare]
    cells = [_split(line, separator) for line, separator in zip(lines, separators, strict=True)]
    if not any(cells):
        raise LogError(f"{path}: is empty; expected a line of column names, then one line per sample")
    values = next((k for k, row in enumerate(cells) if is_data(row)), 1)
    if values > 1 and any(map(_is_number, filter(None, cells[values - 1]))):  # an incomplete line of values
        values = 1
    first = min(values, len(lines) - 1)
    separator = separators[first]
    if separator == " " and values and bare[values - 1].count(" ") != bare[first].count(" "):
        separator = ","  # one name, `Time (s)`
    if values == 0 or (
        values > 1 and COMMENT.match(lines[values - 1]) and len(cells[values - 1]) != len(cells[values])
    ):
        return CsvLayout(_split(lines[values], separator), separator, values, encoding)
    above, names = (_split(COMMENT.sub("", lines[max(k, 0)]), separator) for k in (values - 2, values - 1))
    if values > 1 and len(above) == len(names) and all(map(of_units.fullmatch, names)):
        units = [cell.strip("[](){} ") for cell in names]
        names = [f"{name} [{unit}]" * (unit.lower() not in si) or name for name, unit in zip(above, units, strict=True)]
    elif values > 1 and len(above) == len(names) and 1 < len(set(above)) < len(above):  # two levels, as in pandas
        names = [".".join(filter(None, pair)) for pair in zip(above, names, strict=True)]
    return CsvLayout(names, separator, values, encoding)


def _split(line: str, separator: str) -> list[str]:
    """Split a line of a CSV file."""
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])]


def is_data(cells: list[str]) -> bool:
    """Return whether a line contains values instead of names."""
    # Cells of a line of values that are not numbers.
    value = re.compile(r"(?i)|true|false|null|none|n/?a|\d{4}-\d\d-\d\d.*|\d\d:\d\d.*")
    return any(map(_is_number, cells)) and all(_is_number(cell) or value.fullmatch(cell) for cell in cells)


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", ".", 1))
    except ValueError:
        return cell != "[-]" and re.fullmatch(r"\[[\s\d.,;eE+\-naif]*\]", cell) is not None
    return True


def open_records(path: Path, table: LogTable) -> Recording:
    """Open a Feather file, records of JSON, or a structured array of NumPy, and keep it in memory.

    Fields of fields are columns `<outer>.<inner>`.

    Raises
    ------
    LogError
        As `open_parquet`, or if the file contains no records.
    """
    suffix = path.suffix.lower()
    with foreign(str(path), "a table"):
        if suffix == ".npy":
            array = np.load(path)
            columns = {name: array[name] for name in array.dtype.names or ()}
            data = pa.table({name: [*values] if values.ndim > 1 else values for name, values in columns.items()})
        elif suffix == ".json":
            content = json.loads(path.read_bytes())
            data = pa.Table.from_pylist(content) if isinstance(content, list) else pa.table(content)
        else:
            data = (pyarrow.feather.read_table if suffix == ".feather" else pyarrow.json.read_json)(path)
        if not data.column_names:
            raise LogError(f"{path}: contains no records; expected one per sample, with fields such as position")
        return source_of_columns(_in_memory(data, str(path)), table)


def table_of_frame(frame: object) -> OpenedTable:
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
        return _in_memory(pa.table(frame), "frame")


def _in_memory(data: pa.Table, path: str) -> OpenedTable:
    """Open a table in memory; fields of structs become columns."""
    while any(pa.types.is_struct(field.type) for field in data.schema):
        data = data.flatten()
    lists = [field.name for field in data.schema if is_list(field.type)]
    names, places, widths = spread(data.column_names, _measure_lists(data.select(lists).slice(0, HEAD)))

    def read(columns: list[str], _: Collection[str]) -> Iterator[pa.RecordBatch]:
        with foreign(path, "a table"):
            yield from data.select(columns).to_batches(max_chunksize=BLOCK_ROWS)

    return OpenedTable(path, names, places, len(data), read, lambda name: data.schema.field(name).type, widths, False)
