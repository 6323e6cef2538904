"""friction_torque.parquet: every sample at the full rate, written chunk by chunk."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from stribeck.core.equations.friction_torque.inverse_dynamics import Chunk
from stribeck.core.log.channels import WRENCH


@contextmanager
def friction_table(path: str | Path, rough: Mapping[str, float]) -> Iterator[Callable[[int, Chunk], None]]:
    """Provide a function that appends a chunk of the n-th log to the table, divided by the rough gains of joints.

    Columns: `log`, `time` [s], `support`, `block`, then per joint `friction_torque.<joint>` [N m] or `torque_unit`,
    `velocity.<joint>` [rad/s], and `usable.<joint>`: a fit may use the sample. A floating base has
    `ground_reaction.fx` to `.tz`: the predicted wrench on the only standing foot, in its frame [N, N m].
    """
    writers: list[pq.ParquetWriter] = []

    def write(log: int, chunk: Chunk) -> None:
        table = _make_table(log, chunk, [rough.get(name, 1.0) for name in chunk.samples.joint_names])
        if not writers:
            writers.append(pq.ParquetWriter(path, table.schema, compression="lz4", use_dictionary=["support"]))
        writers[0].write_table(table)

    try:
        yield write
    finally:
        for writer in writers:
            writer.close()


def _make_table(log: int, chunk: Chunk, gains: list[float]) -> pa.Table:
    samples = chunk.samples
    columns = {
        "log": _wrap_array(np.full(len(samples.time), log, dtype=np.int32)),
        "time": _wrap_array(samples.time),
        "support": _wrap_strings(samples.support_names).take(_wrap_array(samples.support)),
        "block": _wrap_array(samples.block),
    }
    # single precision: seven digits in half of the bytes
    torque, velocity = (
        values.T.astype(np.float32, "C") for values in (samples.friction_torque / gains, samples.velocity)
    )
    for k, joint in enumerate(samples.joint_names):
        columns[f"friction_torque.{joint}"] = _wrap_array(torque[k])
        columns[f"velocity.{joint}"] = _wrap_array(velocity[k])
        columns[f"usable.{joint}"] = _wrap_array(samples.usable[:, k])
    if chunk.wrench.size:
        for axis, values in zip(WRENCH, chunk.wrench.T.astype(np.float32), strict=True):
            columns[f"ground_reaction.{axis}"] = _wrap_array(values)
    return pa.table(columns)


def _wrap_array(values: NDArray[Any]) -> pa.Array:
    """Wrap an array of shape (N,) without `pa.array`, which imports pandas and takes longer than the table."""
    kind = pa.from_numpy_dtype(values.dtype)
    stored = np.packbits(values, bitorder="little") if values.dtype == bool else np.ascontiguousarray(values)
    return pa.Array.from_buffers(kind, len(values), [None, pa.py_buffer(stored)])


def _wrap_strings(texts: Sequence[str]) -> pa.Array:
    """Wrap strings without `pa.array`, for the same reason."""
    encoded = [text.encode() for text in texts]
    ends = np.cumsum([0, *map(len, encoded)], dtype=np.int32)
    return pa.StringArray.from_buffers(len(texts), pa.py_buffer(ends), pa.py_buffer(b"".join(encoded)))
