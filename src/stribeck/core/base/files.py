"""Reading of small files that users name, regular files of a bounded size; and hashes of files."""

import hashlib
import stat
from pathlib import Path

from stribeck.core.errors import StribeckError


def read_bytes(path: Path, expected: str, error: type[StribeckError]) -> bytes:
    """Read a file. An `error` reports the problem and the `expected` content, such as "a robot file (TOML)"."""
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):  # opening a pipe would block forever
            what = "a folder" if stat.S_ISDIR(status.st_mode) else "a pipe, a device or a socket"
            raise error(f"{path}: is {what}; expected {expected}")
        if status.st_size > (most := 1 << 25):  # [bytes]; robot files, models, scenarios and results are smaller
            raise error(f"{path}: has {status.st_size:,} bytes; expected {expected}, of {most:,} bytes at most")
        return path.read_bytes()
    except (OSError, ValueError) as reason:  # ValueError: NUL in the path
        raise error(f"{path}: cannot be read ({getattr(reason, 'strerror', reason)}); expected {expected}") from reason


def read_text(path: Path, expected: str, error: type[StribeckError]) -> str:
    """Read a file as UTF-8 text without a byte-order mark; raises the errors of `read_bytes`."""
    try:
        return read_bytes(path, expected, error).decode("utf-8-sig")
    except UnicodeDecodeError as reason:
        line, byte = reason.object[: reason.start].count(b"\n") + 1, reason.object[reason.start]
        raise error(
            f"{path}: line {line} has the byte 0x{byte:02x}, which is not UTF-8; expected {expected} in UTF-8"
        ) from reason


def sha256(path: str) -> str:
    """Compute the SHA-256 of a file, or of all files of a folder in the order of their names; "" for no file."""
    root = Path(path)
    if not path or not root.exists():
        return ""
    files = [root] if root.is_file() else sorted(file for file in root.rglob("*") if file.is_file())
    digest = hashlib.sha256()
    for file in files:
        with file.open("rb") as stream:
            hashlib.file_digest(stream, lambda: digest)
    return digest.hexdigest()
