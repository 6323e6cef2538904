"""NumPy archives: `.npz`, plain arrays only (nothing pickled is ever opened)."""

import io
import math
import zipfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from stribeck.errors import LogError
from stribeck.log.readers.arrays import WORDS, StoredArray, source_of_arrays
from stribeck.log.readers.source import Source, foreign
from stribeck.log.storage import BLOCK_ROWS, check_size
from stribeck.settings import LogTable

Header = tuple[tuple[int, ...], bool, np.dtype[Any]]
HEADERS: dict[tuple[int, int], Callable[[IO[bytes]], Header]] = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}
LONGEST_HEADER = 1 << 16  # bytes; of arrays of numbers it is a line


def open_npz(path: Path, table: LogTable) -> Source:
    """Open an `.npz` file with arrays named as the channels of RobotLog.

    Raises
    ------
    LogError
        If it is damaged, holds pickled objects where numbers are wanted, or lacks an array that `[log]` names.
    """
    with foreign(str(path), "NumPy .npz"), zipfile.ZipFile(path) as archive:
        for member in archive.infolist():
            archive.open(member).close()  # its own header must name it as the directory does
        members = [name for name in archive.namelist() if name.endswith(".npy")]
        arrays = {name.removesuffix(".npy"): _stored(path, archive, name) for name in members}
        words = {name: _words(arrays[name], name, path) for name in WORDS if name in arrays}
        if not arrays:
            raise LogError(f"{path}: holds no arrays; expected at least 'position' and 'torque'")
    return source_of_arrays(str(path), arrays, words, table)


def _stored(path: Path, archive: zipfile.ZipFile, member: str) -> StoredArray:
    with archive.open(member) as file:
        shape, fortran, dtype = _header(file)
        if math.prod(shape) * dtype.itemsize + file.tell() > archive.getinfo(member).file_size:
            raise ValueError(f"array {member} is shorter than its own header says")
    return StoredArray(shape, dtype, partial(_blocks, path, member, shape, fortran, dtype))


def _header(file: IO[bytes]) -> Header:
    """Read an array's header, which may claim to be gigabytes long."""
    start = io.BytesIO(file.read(LONGEST_HEADER))
    version = np.lib.format.read_magic(start)
    if version not in HEADERS:
        raise ValueError(f"array format {version} is not supported")
    header = HEADERS[version](start)
    file.seek(start.tell())
    return header


def _blocks(
    path: Path, member: str, shape: tuple[int, ...], fortran: bool, dtype: np.dtype[Any]
) -> Iterator[NDArray[np.generic]]:
    """Give the rows of an array in blocks; one in Fortran order comes as a single block."""
    with foreign(str(path), "NumPy .npz"), zipfile.ZipFile(path) as archive, archive.open(member) as file:
        _header(file)
        if fortran or not shape:
            data = _read(file, math.prod(shape), dtype)
            yield data.reshape(shape, order="F")
            return
        row_values = math.prod(shape[1:])
        for start in range(0, shape[0], BLOCK_ROWS):
            rows = min(BLOCK_ROWS, shape[0] - start)
            yield _read(file, rows * row_values, dtype).reshape(rows, *shape[1:])


def _read(file: IO[bytes], count: int, dtype: np.dtype[Any]) -> NDArray[np.generic]:
    if dtype.hasobject:
        raise ValueError("the array holds pickled Python objects, which are not opened")
    data = file.read(count * dtype.itemsize)
    if len(data) < count * dtype.itemsize:
        raise ValueError(f"an array ends after {len(data)} of {count * dtype.itemsize} bytes")
    return np.frombuffer(data, dtype=dtype)


def _words(stored: StoredArray, name: str, path: Path) -> tuple[str, ...]:
    check_size(str(path), stored.size)
    if stored.dtype.kind not in "US":
        raise LogError(f"{path}: array '{name}' holds values of type {stored.dtype}; expected text")
    values = np.concatenate([block.reshape(-1) for block in stored.blocks()] or [np.empty(0, "U1")])
    return tuple(value.decode() if isinstance(value, bytes) else str(value) for value in values)
