"""Columns that hold a list in every row, read as a column a place: `position` as `position[0]`, `position[1]`, ..."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.compute

from stribeck.errors import LogError
from stribeck.log.readers.columns import Batches, Table
from stribeck.typing import Array

WIDEST = 1000
"""Values in a row; beyond that a column holds pictures or the like."""


def is_list(kind: pa.DataType) -> bool:
    """Return whether a column of this type holds a list of numbers in every row."""
    of_lists = pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind)
    return bool(of_lists and (pa.types.is_floating(kind.value_type) or pa.types.is_integer(kind.value_type)))


def spread(table: Table, lists: Collection[str]) -> Table:
    """Return a table whose list columns are columns of their own, as many as the first list has values.

    Raises
    ------
    LogError
        If a list, once its column is read, has more or fewer values than the first.
    """
    widths = {name: _width(table, name) for name in table.names if name in lists}
    widths = {name: width for name, width in widths.items() if 0 < width <= WIDEST}
    places = {f"{name}[{place}]": (name, place) for name, width in widths.items() for place in range(width)}
    names = [
        spread_name
        for name in table.names
        for spread_name in ([f"{name}[{place}]" for place in range(widths[name])] if name in widths else [name])
    ]
    return replace(table, names=names, batches=_spread_batches(table, places, widths)) if places else table


def _width(table: Table, name: str) -> int:
    """Return how many values the first list of a column has; 0 where there is none."""
    for batch in table.batches([name], ()):
        sizes = _cells(batch.column(0), 0, name, table.path)[0]
        if sizes.any():
            return int(sizes[sizes > 0][0])
    return 0


def _spread_batches(table: Table, places: Mapping[str, tuple[str, int]], widths: Mapping[str, int]) -> Batches:
    def batches(columns: list[str], free: Collection[str]) -> Iterator[pa.RecordBatch]:
        stored = list(dict.fromkeys(places[name][0] if name in places else name for name in columns))
        row = 0
        for batch in table.batches(stored, free):
            parts = {
                name: _values(batch.column(name), widths[name], row, name, table.path)
                for name in stored
                if name in widths
            }
            arrays = [
                pa.array(parts[places[name][0]][:, places[name][1]]) if name in places else batch.column(name)
                for name in columns
            ]
            row += batch.num_rows
            yield pa.record_batch(arrays, names=columns)

    return batches


def _values(column: pa.Array, width: int, row: int, name: str, path: str) -> Array:
    """Return the lists of a column as shape (rows, width), NaN where there is none; `row` is its first row's number."""
    sizes, flat = _cells(column, row, name, path)
    uneven = np.flatnonzero((sizes != width) & (sizes != 0))
    if uneven.size:
        raise LogError(
            f"{path}: column '{name}' holds {sizes[uneven[0]]} values in row {row + uneven[0] + 1} and {width} before; "
            "expected as many in every row"
        )
    values = np.full((len(column), width), np.nan)
    values[sizes > 0] = flat.reshape(-1, width)
    return values


def _cells(
    column: pa.Array, row: int, name: str, path: str
) -> tuple[np.ndarray[tuple[int], np.dtype[np.int64]], Array]:
    """Return how many values each cell holds, 0 for an empty one, and all of them in a row."""
    if pa.types.is_string(column.type):
        texts = [_numbers(text, row + k, name, path) for k, text in enumerate(column.to_pylist())]
        return np.array([len(text) for text in texts], dtype=np.int64), np.concatenate([np.zeros(0), *texts])
    sizes = pyarrow.compute.fill_null(pyarrow.compute.list_value_length(column), 0)
    flat = np.asarray(column.flatten().to_numpy(zero_copy_only=False), dtype=np.float64)
    return np.asarray(sizes.to_numpy(zero_copy_only=False), dtype=np.int64), flat


def _numbers(text: str | None, row: int, name: str, path: str) -> Array:
    """Return the numbers of a cell like `[1.0, 2.0]`, with commas or blanks between them."""
    if not text or not text.strip():
        return np.zeros(0)
    inner = text.strip()
    try:
        if not (inner.startswith("[") and inner.endswith("]")):
            raise ValueError
        return np.array(inner[1:-1].replace(",", " ").split(), dtype=np.float64)
    except ValueError as error:
        raise LogError(
            f"{path}: column '{name}' holds '{inner[:40]}' in row {row + 1}; expected a list of numbers like [1.0, 2.0]"
        ) from error
