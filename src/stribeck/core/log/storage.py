"""Memory for channels: ordinary arrays, or arrays on an unlinked temporary file if they are large."""

import math
import mmap
import os
import shutil
import tempfile
import weakref
from pathlib import Path

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.errors import LogError

IN_MEMORY_LIMIT = 1 << 29
"""Memory for the channels of all logs together [bytes]."""

BLOCK_ROWS = 1 << 16
"""Number of rows per block; 100 channels take about 50 MB."""

EXPANSION = 200
"""Largest ratio of samples to file size [1]; files with a larger ratio are refused as bombs.

Measured signals hardly compress more than tenfold.
"""


def too_large(path: str) -> str:
    """Describe that a log does not fit in memory or on disk."""
    return (
        f"{path}: is too large for memory and for the temporary folder {tempfile.gettempdir()}; "
        "set TMPDIR to a folder on a larger disk"
    )


_in_memory: list[weakref.ref[Array]] = []
"""Weak references to allocated arrays; dead ones are dropped at the next allocation."""

_on_disk: list[weakref.ref[mmap.mmap]] = []
"""Weak references to the maps of arrays on disk; a list, because other threads may allocate at the same time."""


def stored_bytes(path: Path) -> int:
    """Compute the size of a file on disk, which is smaller than its length if the file has holes."""
    status = path.stat()
    blocks = getattr(status, "st_blocks", 0)  # of 512 bytes; some file systems do not count them
    return min(status.st_size, 512 * blocks) if blocks else status.st_size


def check_size(path: str, size: int) -> None:
    """Refuse samples whose declared `size` [bytes] is too large, before they are unpacked.

    Raises
    ------
    LogError
        If the file is far too small for its samples (a bomb).
    MemoryError
        If they do not fit.
    """
    stored = stored_bytes(Path(path))
    if size > max(IN_MEMORY_LIMIT, EXPANSION * stored):
        raise LogError(
            f"{path}: declares {size:.2g} bytes of samples, but has {stored} bytes; expected measured signals"
        )
    if size > IN_MEMORY_LIMIT + shutil.disk_usage(tempfile.gettempdir()).free:
        raise MemoryError


def release_memory() -> None:
    """Remove the pages of arrays on disk from the memory of this process; they return when they are read."""
    for reference in [*_on_disk] if hasattr(mmap, "MADV_DONTNEED") else ():
        if (mapped := reference()) is not None:
            mapped.madvise(mmap.MADV_DONTNEED)


def allocate(shape: tuple[int, ...]) -> Array:
    """Allocate an array of zeros, on an unlinked temporary file if arrays in memory would exceed `IN_MEMORY_LIMIT`.

    The operating system writes such an array to disk when memory is short, and the file vanishes with the array.
    Earlier arrays leave the memory of this process.

    Raises
    ------
    LogError
        If the disk is full.
    """
    size = 8 * math.prod(shape)
    living = [array for reference in _in_memory if (array := reference()) is not None]
    if size + sum(array.nbytes for array in living) <= IN_MEMORY_LIMIT:
        zeros: Array = np.zeros(shape)
        _in_memory[:] = [weakref.ref(array) for array in (*living, zeros)]
        return zeros
    release_memory()
    with tempfile.TemporaryFile(prefix="stribeck-") as file:
        if hasattr(os, "posix_fallocate"):  # detect a full disk now, not by a crash when a page is written
            try:
                os.posix_fallocate(file.fileno(), 0, size)
            except OSError as error:
                raise LogError(too_large("log")) from error
        mapped = np.memmap(file, dtype=np.float64, mode="w+", shape=shape)
    _on_disk.append(weakref.ref(mapped._mmap))  # type: ignore[attr-defined]
    return np.asarray(mapped)
