"""Memory for channels: ordinary arrays, and beyond a size arrays on an unlinked temporary file."""

import math
import os
import shutil
import tempfile
import weakref
from pathlib import Path

import numpy as np

from stribeck.base.typing import Array
from stribeck.errors import LogError

IN_MEMORY_LIMIT = 1 << 29
"""What channels may take of memory, those of all logs together [bytes]."""

BLOCK_ROWS = 1 << 16
"""Rows that are worked through at once: a block of 100 channels of them takes about 50 MB."""

EXPANSION = 200
"""Bytes of samples a byte of a file [1], above which a file is refused as a bomb.

An estimate: measured signals hardly compress more than tenfold.
"""


def too_large(path: str) -> str:
    """Return that a log finds no room."""
    return (
        f"{path}: is too large for this machine's memory and the folder of temporary files, {tempfile.gettempdir()}; "
        "expected room in one of them (TMPDIR can name a folder on a larger disk)"
    )


_in_memory: list[weakref.ref[Array]] = []
"""Arrays that were handed out; those that are gone are struck off when the next is asked for."""


def stored_bytes(path: Path) -> int:
    """Return how many bytes of a file are on the disk: one with holes says that it is longer."""
    status = path.stat()
    blocks = getattr(status, "st_blocks", 0)  # of 512 bytes; some systems and file systems do not count them
    return min(status.st_size, 512 * blocks) if blocks else status.st_size


def check_size(path: str, size: int) -> None:
    """Refuse samples that take `size` bytes by a file's own account, before the first of them is unpacked.

    Raises
    ------
    LogError
        If the file is far too small to hold them (a bomb).
    MemoryError
        If there is no room for them.
    """
    stored = stored_bytes(Path(path))
    if size > max(IN_MEMORY_LIMIT, EXPANSION * stored):
        raise LogError(
            f"{path}: declares {size:.2g} bytes of samples and has {stored}; expected a log of measured signals"
        )
    if size > IN_MEMORY_LIMIT + shutil.disk_usage(tempfile.gettempdir()).free:
        raise MemoryError


def allocate(shape: tuple[int, ...]) -> Array:
    """Return an array of zeros, on an unlinked temporary file where those in memory would go beyond `IN_MEMORY_LIMIT`.

    The operating system writes such an array out when memory is short, and the file vanishes with the array.

    Raises
    ------
    LogError
        If the disk has no room for it.
    """
    size = 8 * math.prod(shape)
    living = [array for reference in _in_memory if (array := reference()) is not None]
    if size + sum(array.nbytes for array in living) <= IN_MEMORY_LIMIT:
        found: Array = np.zeros(shape)
        _in_memory[:] = [weakref.ref(array) for array in (*living, found)]
        return found
    with tempfile.TemporaryFile(prefix="stribeck-") as file:
        if hasattr(os, "posix_fallocate"):  # a full disk is told now, and not by a crash when a page is written
            try:
                os.posix_fallocate(file.fileno(), 0, size)
            except OSError as error:
                raise LogError(too_large("log")) from error
        return np.asarray(np.memmap(file, dtype=np.float64, mode="w+", shape=shape))
