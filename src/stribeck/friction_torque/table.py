"""friction_torque.parquet: every sample at the full rate, written as it is worked out."""

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from stribeck.friction_torque.foot_wrenches import AXES
from stribeck.friction_torque.inverse_dynamics import Chunk


@contextmanager
def friction_table(path: str | Path) -> Iterator[Callable[[int, Chunk], None]]:
    """Give a function that appends a chunk of the n-th log to the table.

    Columns: `log`, `time` [s], `support`, `block`, then per joint `friction_torque.<joint>` [N m],
    `velocity.<joint>` [rad/s], and `usable.<joint>`: a fit may use the sample. A floating base has
    `ground_reaction.fx` to `.tz`: the wrench that the model predicts on the only standing foot, in its frame [N, N m].
    """
    with ThreadPoolExecutor(1) as background:
        writers: list[pq.ParquetWriter] = []
        pending: list[Future[None]] = []

        def write(log: int, chunk: Chunk) -> None:
            table = _table(log, chunk)
            if not writers:
                writers.append(pq.ParquetWriter(path, table.schema, compression="lz4", use_dictionary=["support"]))
            writers[0].write_table(table)

        def append(log: int, chunk: Chunk) -> None:
            """Write while the next chunk is worked out; one chunk waits at most."""
            for earlier in pending:
                earlier.result()
            pending[:] = [background.submit(write, log, chunk)]

        try:
            yield append
            for last in pending:
                last.result()
        finally:
            background.shutdown()
            for writer in writers:
                writer.close()


def _table(log: int, chunk: Chunk) -> pa.Table:
    samples = chunk.samples
    names = pa.array(samples.support_names, pa.string())
    single = pa.float32()  # seven digits, half the bytes
    columns = {
        "log": pa.array([log] * len(samples.time), pa.int32()),
        "time": pa.array(samples.time),
        "support": pa.DictionaryArray.from_arrays(pa.array(samples.support, pa.int32()), names).cast(pa.string()),
        "block": pa.array(samples.block),
    }
    for k, joint in enumerate(samples.joint_names):
        columns[f"friction_torque.{joint}"] = pa.array(samples.friction_torque[:, k]).cast(single)
        columns[f"velocity.{joint}"] = pa.array(samples.velocity[:, k]).cast(single)
        columns[f"usable.{joint}"] = pa.array(samples.usable[:, k])
    if chunk.wrench.size:
        for k, axis in enumerate(AXES):
            columns[f"ground_reaction.{axis}"] = pa.array(chunk.wrench[:, k]).cast(single)
    return pa.table(columns)
