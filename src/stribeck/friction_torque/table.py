"""friction_torque.parquet: every sample at the full rate, written as it is worked out."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from stribeck.friction_torque.foot_wrenches import AXES
from stribeck.friction_torque.inverse_dynamics import Chunk


@contextmanager
def friction_table(path: str | Path) -> Iterator[Callable[[int, Chunk], None]]:
    """Give a function that appends a chunk of the n-th log to the table.

    Columns: `log`, `time` [s], `support`, `block`, then per joint `friction_torque.<joint>` [N m],
    `velocity.<joint>` [rad/s], and `usable.<joint>`: a fit may use the sample. A floating base has
    `ground_reaction.fx` to `.tz`: the wrench that the model predicts on the only standing foot, in its frame [N, N m].
    """
    writers: list[pq.ParquetWriter] = []

    def write(log: int, chunk: Chunk) -> None:
        table = _table(log, chunk)
        if not writers:
            writers.append(pq.ParquetWriter(path, table.schema, compression="lz4", use_dictionary=["support"]))
        writers[0].write_table(table)

    try:
        yield write
    finally:
        for writer in writers:
            writer.close()


def _table(log: int, chunk: Chunk) -> pa.Table:
    samples = chunk.samples
    columns = {
        "log": _column(np.full(len(samples.time), log, dtype=np.int32)),
        "time": _column(samples.time),
        "support": _texts(samples.support_names).take(_column(samples.support)),
        "block": _column(samples.block),
    }
    # single precision: seven digits, half the bytes
    torque, velocity = (values.T.astype(np.float32, "C") for values in (samples.friction_torque, samples.velocity))
    for k, joint in enumerate(samples.joint_names):
        columns[f"friction_torque.{joint}"] = _column(torque[k])
        columns[f"velocity.{joint}"] = _column(velocity[k])
        columns[f"usable.{joint}"] = _column(samples.usable[:, k])
    if chunk.wrench.size:
        for axis, values in zip(AXES, chunk.wrench.T.astype(np.float32), strict=True):
            columns[f"ground_reaction.{axis}"] = _column(values)
    return pa.table(columns)


def _column(values: NDArray[Any]) -> pa.Array:
    """Wrap an array of shape (N,); `pa.array` does the same, but imports pandas, which takes longer than the table."""
    kind = pa.from_numpy_dtype(values.dtype)
    stored = np.packbits(values, bitorder="little") if values.dtype == bool else np.ascontiguousarray(values)
    return pa.Array.from_buffers(kind, len(values), [None, pa.py_buffer(stored)])


def _texts(texts: Sequence[str]) -> pa.Array:
    """Make a column of texts, for the same reason."""
    encoded = [text.encode() for text in texts]
    ends = np.cumsum([0, *map(len, encoded)], dtype=np.int32)
    return pa.StringArray.from_buffers(len(texts), pa.py_buffer(ends), pa.py_buffer(b"".join(encoded)))
