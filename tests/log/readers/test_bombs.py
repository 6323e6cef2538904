"""Small files that declare more data than fits in memory are refused immediately."""

import time
import zipfile
from types import SimpleNamespace

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

from stribeck.errors import LogError
from stribeck.log.readers import read_log

LIMIT = 1 << 24
"""Memory limit of these tests [bytes]."""
ROWS = 1 << 20
"""Number of rows of time and two joints that exceeds the limit."""


def npz(path, rows=ROWS):
    """Write zeros, which compress to a thousandth."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, shape in (("time", (rows,)), ("position", (rows, 2)), ("torque", (rows, 2))):
            with archive.open(f"{name}.npy", "w") as file:
                np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": shape})
                for _ in range(0, 8 * int(np.prod(shape)), 1 << 22):
                    file.write(bytes(1 << 22))


def hdf5(path):
    with h5py.File(path, "w") as file:
        for name, shape in (("time", (10**12,)), ("position", (10**12, 2)), ("torque", (10**12, 2))):
            file.create_dataset(name, shape, float, chunks=(1024, *shape[1:]))


def parquet(path):
    names = ("time", "position.hip", "position.knee", "torque.hip", "torque.knee")
    batch = pa.table(dict.fromkeys(names, np.zeros(1 << 20)))
    with pyarrow.parquet.ParquetWriter(path, batch.schema) as writer:
        for _ in range(0, ROWS, 1 << 20):
            writer.write_table(batch)


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (npz, "log.npz"),
        (hdf5, "log.h5"),
        (parquet, "log.parquet"),
    ],
)
def test_more_samples_than_the_file_can_hold(make, name, tmp_path, monkeypatch):
    monkeypatch.setattr("stribeck.log.storage.IN_MEMORY_LIMIT", LIMIT)
    make(tmp_path / name)
    start = time.process_time()
    with pytest.raises(LogError, match=r"declares .* bytes of samples") as refused:
        read_log(tmp_path / name)
    assert time.process_time() - start < 1.0
    assert len(str(refused.value).splitlines()) == 1


def test_no_room_for_a_sound_log(tmp_path, monkeypatch):
    np.savez(tmp_path / "log.npz", time=np.arange(9.0), position=np.ones((9, 2)), torque=np.ones((9, 2)))
    monkeypatch.setattr("stribeck.log.storage.IN_MEMORY_LIMIT", 100)
    monkeypatch.setattr("stribeck.log.storage.shutil.disk_usage", lambda _: SimpleNamespace(free=100))
    with pytest.raises(LogError, match="too large for memory"):
        read_log(tmp_path / "log.npz")
