"""Tables in memory, of pandas, polars or any library with the Arrow interface."""

from collections.abc import Collection, Iterator

import pyarrow as pa

from stribeck.errors import LogError
from stribeck.log.readers.columns import Table
from stribeck.log.readers.lists import is_list, spread
from stribeck.log.readers.source import foreign
from stribeck.log.storage import BLOCK_ROWS


def table_of_frame(frame: object) -> Table:
    """Return the table of a frame; an index that has a name is a column too.

    Raises
    ------
    LogError
        If it is no frame, or has columns that Arrow cannot hold.
    """
    if not hasattr(frame, "__arrow_c_stream__"):
        raise LogError(
            f"frame: is of type '{type(frame).__name__}'; expected a table of pandas, polars or another library with "
            "the Arrow interface (__arrow_c_stream__)"
        )
    with foreign("frame", "a table"):
        columns = pa.table(frame)

    def batches(names: list[str], _: Collection[str]) -> Iterator[pa.RecordBatch]:
        with foreign("frame", "a table"):
            yield from columns.select(names).to_batches(max_chunksize=BLOCK_ROWS)

    table = Table("frame", columns.column_names, columns.num_rows, batches, on_disk=False)
    return spread(table, {field.name for field in columns.schema if is_list(field.type)})
