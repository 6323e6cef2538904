"""Whether the files of a bag are whole: what their formats let one check before any message is read."""

import sqlite3
import zlib
from pathlib import Path
from urllib.parse import quote

import lz4.frame
import zstandard
from mcap.records import Chunk, Footer
from mcap.stream_reader import StreamReader

from stribeck.errors import LogError
from stribeck.log.storage import IN_MEMORY_LIMIT

FOOTER_AND_MAGIC = 37
"""Bytes at the end of an MCAP file that follow its summary: a record of 9 + 20 bytes, and 8 bytes of magic."""


def check_mcap(path: Path) -> None:
    """Check every checksum of an MCAP file: of its chunks, its data and its summary.

    Raises
    ------
    ValueError, LogError
        If one is wrong, or a chunk would not fit in memory.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        for record in StreamReader(file, emit_chunks=True, validate_crcs=True, record_size_limit=size).records:
            if isinstance(record, Chunk):
                _check_chunk(record, path)
            elif isinstance(record, Footer) and record.summary_crc and record.summary_start:
                file.seek(record.summary_start)
                summary = file.read(size - record.summary_start - FOOTER_AND_MAGIC + 25)  # up to the checksum itself
                if zlib.crc32(summary) != record.summary_crc:
                    raise ValueError("the checksum of its summary is wrong")
                file.seek(size - 8)  # where the reader goes on


def _check_chunk(chunk: Chunk, path: Path) -> None:
    """Unpack a chunk piece by piece, so that one that lies about its size is met before it is in memory."""
    if chunk.uncompressed_size > IN_MEMORY_LIMIT:
        raise LogError(
            f"{path}: has a chunk of {chunk.uncompressed_size:.2g} bytes; expected at most {IN_MEMORY_LIMIT:.2g}"
        )
    most = chunk.uncompressed_size + 1
    if chunk.compression == "zstd":
        with zstandard.ZstdDecompressor(max_window_size=IN_MEMORY_LIMIT).stream_reader(chunk.data) as stream:
            data = stream.read(most)
    elif chunk.compression == "lz4":
        data = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=most)
    elif chunk.compression == "":
        data = chunk.data
    else:
        raise ValueError(f"compression '{chunk.compression}' is none of zstd, lz4")
    if len(data) != chunk.uncompressed_size:
        raise ValueError(f"a chunk is not of the {chunk.uncompressed_size} bytes that it says")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise ValueError("the checksum of a chunk is wrong")


def check_sqlite(path: Path) -> None:
    """Check that a database is as long as it says, that its pages fit together, and that nothing lies beside it.

    Raises
    ------
    ValueError, sqlite3.Error, LogError
        If not.
    """
    for suffix in ("-wal", "-journal"):
        beside = path.with_name(path.name + suffix)
        if beside.exists() and beside.stat().st_size:
            raise LogError(
                f"{beside}: holds messages that were never merged into the bag, which was not closed; expected a "
                f"closed bag (with a copy of the folder, sqlite3 {path.name} 'PRAGMA wal_checkpoint' merges them)"
            )
    with path.open("rb") as file:
        header = file.read(100)
    pages, known = int.from_bytes(header[28:32]), header[24:28] == header[92:96]
    page = int.from_bytes(header[16:18])
    expected = pages * (1 << 16 if page == 1 else page)
    if known and expected > path.stat().st_size:
        raise ValueError(f"{path.name} ends after {path.stat().st_size} of {expected} bytes")
    database = sqlite3.connect(f"file:{quote(str(path))}?immutable=1&mode=ro", uri=True)
    try:
        found = database.execute("PRAGMA integrity_check(1)").fetchone()[0]
    finally:
        database.close()
    if found != "ok":
        raise ValueError(f"{path.name}: {found}")
