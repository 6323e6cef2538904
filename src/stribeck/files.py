"""Files that a user names and that are read whole: only regular ones, of a bounded size, are opened."""

import os
import stat
from pathlib import Path

from stribeck.errors import StribeckError

MOST_BYTES = 1 << 25
"""No robot file, model, scenario or result is as large [bytes]."""
KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a named pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


def read_bytes(path: Path, expected: str, error: type[StribeckError]) -> bytes:
    """Return what a file holds.

    Parameters
    ----------
    path
        The file.
    expected
        What it should be, for messages: "a robot file (TOML)".
    error
        What is raised.

    Raises
    ------
    StribeckError
        If it is missing, not readable, not a regular file, or too large; an `error`.
    """
    try:
        reason = irregular(path)
        if reason:
            raise error(f"{path}: is {reason}; expected {expected}")
        if (size := path.stat().st_size) > MOST_BYTES:
            raise error(f"{path}: has {size:,} bytes; expected {expected}, of {MOST_BYTES:,} bytes at most")
        with path.open("rb") as file:
            return file.read(MOST_BYTES)
    except (OSError, ValueError) as reason:  # ValueError: a NUL in its name
        raise error(f"{path}: cannot be read ({getattr(reason, 'strerror', reason)}); expected {expected}") from reason


def read_text(path: Path, expected: str, error: type[StribeckError]) -> str:
    """Return the text of a file in UTF-8, without a byte-order mark; what it raises is as of `read_bytes`."""
    content = read_bytes(path, expected, error)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as reason:
        line = content[: reason.start].count(b"\n") + 1
        raise error(
            f"{path}: line {line} has the byte 0x{content[reason.start]:02x}, which is not UTF-8; expected {expected} "
            "in UTF-8"
        ) from reason


def irregular(path: Path) -> str:
    """Return what a path leads to, in words, if that is no regular file; opening a pipe would wait for ever."""
    mode = os.stat(path).st_mode
    return "" if stat.S_ISREG(mode) else KINDS.get(stat.S_IFMT(mode), "no regular file")
