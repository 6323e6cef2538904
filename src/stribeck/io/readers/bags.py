"""rosbag2 folders (SQLite or MCAP inside), ROS 1 `.bag` and single `.mcap` files, read without ROS."""

from __future__ import annotations

import json
import re
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, nullcontext, suppress
from dataclasses import replace
from functools import cache, partial
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

import lz4.frame
import numpy as np
import zstandard
from mcap.records import Channel, Chunk, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from stribeck.core.errors import LogError, listed
from stribeck.core.log.storage import IN_MEMORY_LIMIT, check_size
from stribeck.core.settings import LogTable
from stribeck.io.readers.join import NANO, Stream, join
from stribeck.io.readers.messages import DEFINITIONS, JOINT_TYPES, READ, open_protobuf
from stribeck.io.readers.recording import Loaded, Recording, Wanted, foreign
from stribeck.io.readers.topics import Messages, Topics, asked_fields, collect

ENCODINGS = ("cdr", "ros1", "json", "protobuf")
"""Encodings of MCAP messages that are read."""


def open_bag(path: Path, table: LogTable) -> Recording:
    """Open a bag with joint states, and with IMU, foot wrench and contact messages if present.

    Raises
    ------
    LogError
        If it is damaged, or has no joint states.
    """
    topics = Topics(asked_fields(table))
    read = _read_folder if path.is_dir() else _read_mcap if path.suffix.lower() == ".mcap" else _read_rosbag
    with foreign(str(path), "a bag"):
        streams = collect(read(path, topics), str(path), topics)
    return _join(streams, str(path), topics, table)


def _join(streams: list[Stream], path: str, topics: Topics, table: LogTable) -> Recording:
    """Make the recording of the streams of a bag; without joints, it only lists their topics."""
    joints = any(stream.kind == "joints" for stream in streams)
    for topic, error in topics.refused.items():
        if topic in topics.fields or not joints:
            raise error
    if joints:
        return join(path, streams, (*topics.others, *topics.refused), table)
    names = dict.fromkeys([*(stream.topic for stream in streams), *topics.others])
    types = f"messages of type {listed(JOINT_TYPES)}, or numbers in other messages as '<topic>.<field>'"
    return Recording(path=path, channels={}, load=lambda _: ({}, []), others=(*names,), expected={"position": types})


def open_parts(path: Path, table: LogTable, seconds: float) -> Iterator[Recording]:
    """Open parts of some seconds of an MCAP file, or of standard input for "-"; stamps count from the first one.

    Raises
    ------
    LogError
        If it is damaged, or has no joint states.
    """
    topics, part, first = Topics(asked_fields(table)), list[tuple[str, str, int, Any]](), list[int]()
    name, source = ("standard input", Path("/dev/stdin")) if str(path) == "-" else (str(path), path)

    def recording() -> Recording:
        log = _join(collect(iter(part), name, topics), name, topics, table)

        def load(wanted: Wanted) -> Loaded:
            columns, notes = log.load(wanted)
            if "time" in columns:
                first.append(int(columns["time"].flat[0]))
                columns["time"] = columns["time"].astype(np.int64) - first[0]
            return columns, notes

        return replace(log, load=load)

    with foreign(name, "MCAP"):
        for message in _read_mcap(source, topics):
            if part and message[2] - part[0][2] >= seconds * NANO:
                yield recording()
                part.clear()
            part.append(message)
        if part:
            yield recording()


def _read_folder(path: Path, topics: Topics) -> Messages:
    """Read the messages of a rosbag2; compressed files or messages are unpacked within bounds."""
    metadata = path / "metadata.yaml"
    text = metadata.read_text(encoding="utf-8", errors="replace") if metadata.is_file() else None
    pattern = r"""^\s*-\s+(?:path:\s+)?["']?(.+?\.(?:db3|mcap)(?:\.zstd)?)["']?\s*$"""
    names = dict.fromkeys(re.findall(pattern, text or "", re.MULTILINE))
    here = sorted(file for file in path.iterdir() if file.suffix.lower() in (".db3", ".mcap") and file.is_file())
    named = here if text is None else [path / PurePath(name).name for name in names]
    files = [file for file in named if file.exists() or ".mcap" not in file.suffixes] or named  # a part of a recording
    if not files:
        raise ValueError("metadata.yaml names no files")
    if missing := [str(file) for file in files if not file.exists()]:
        raise ValueError(f"Some database files are missing: {missing}")
    mode = re.search(r"compression_mode:\s*[\"']?(\w+)", text or "")
    packed = mode[1].lower() if mode else ""
    with TemporaryDirectory(prefix="stribeck-") as folder:
        for file in files:
            plain = _unpack_file(file, Path(folder, file.stem)) if packed == "file" else file
            read = _read_mcap if plain.suffix == ".mcap" else _read_rosbag
            yield from read(plain, topics, _unpack if packed == "message" else bytes)


def _unpack_file(packed: Path, target: Path) -> Path:
    """Unpack a file to a target, and return the target; refuse it as soon as it is far too large."""
    with packed.open("rb") as file, target.open("wb") as out:
        unpacker = zstandard.ZstdDecompressor(max_window_size=IN_MEMORY_LIMIT)
        stream = unpacker.stream_reader(file, read_across_frames=True)
        while block := stream.read(1 << 20):
            check_size(str(packed), out.tell() + len(block))
            out.write(block)
    return target


def _unpack(data: bytes, most: int = IN_MEMORY_LIMIT) -> bytes:
    """Unpack Zstandard data, at most `most` bytes."""
    with zstandard.ZstdDecompressor(max_window_size=IN_MEMORY_LIMIT).stream_reader(data) as stream:
        return bytes(stream.read(most))


def _check_database(path: Path) -> None:
    """Check that an SQLite file has the declared length, passes its integrity check, and was closed.

    Raises
    ------
    ValueError, sqlite3.Error, LogError
        If not.
    """
    for suffix in ("-wal", "-journal"):
        journal = path.with_name(path.name + suffix)
        if journal.exists() and journal.stat().st_size:
            raise LogError(
                f"{journal}: contains messages that were not merged, because the bag was not closed; expected a "
                f"closed bag (with a copy of the folder, sqlite3 {path.name} 'PRAGMA wal_checkpoint' merges them)"
            )
    with closing(sqlite3.connect(f"{path.resolve().as_uri()}?immutable=1&mode=ro", uri=True)) as database:
        pages, page, integrity = (
            database.execute(f"PRAGMA {name}").fetchone()[0]
            for name in ("page_count", "page_size", "integrity_check(1)")
        )
    size = path.stat().st_size
    if pages * page > size:
        raise ValueError(f"{path.name} ends after {size} of {pages * page} bytes")
    if integrity != "ok":
        raise ValueError(f"{path.name}: {integrity}")


def _read_rosbag(path: Path, topics: Topics, unpack: Callable[[bytes], bytes] = bytes) -> Messages:
    """Read the messages of a ROS 1 bag, or of a rosbag2's SQLite file."""
    with ExitStack() as stack:
        if path.suffix != ".bag":
            _check_database(path)
        if {*"#?%"} & {*str(path)}:  # rosbags makes a URI of the path
            link = Path(stack.enter_context(TemporaryDirectory(prefix="stribeck-")), f"bag{path.suffix}")
            link.symlink_to(path.resolve())
            path = link
        reader = stack.enter_context(AnyReader([path], default_typestore=_types()))
        connections = [entry for entry in reader.connections if topics.uses(entry.topic, entry.msgtype)]
        for connection in sorted(reader.connections, key=lambda connection: connection.topic):
            if connection not in connections:
                topics.add(connection.topic, partial(_first_message, reader, connection, unpack))
        if not connections:  # AnyReader reads all messages if the choice is empty
            return
        types = reader.typestore.fielddefs
        if not {connection.msgtype for connection in connections} <= types.keys():  # some bags define only some types
            reader.typestore.register({name: kind for name, kind in _types().fielddefs.items() if name not in types})
        for connection, recorded, data in reader.messages(connections=connections):
            message = reader.deserialize(unpack(data), connection.msgtype)
            yield connection.topic, connection.msgtype, recorded, message


def _first_message(reader: AnyReader, connection: Connection, unpack: Callable[[bytes], bytes]) -> object:
    return reader.deserialize(unpack(next(reader.messages(connections=[connection]))[2]), connection.msgtype)


def _read_mcap(path: Path, topics: Topics, unpack: Callable[[bytes], bytes] = bytes) -> Messages:
    schemas: dict[int, Schema] = {}
    channels: dict[int, tuple[str, str, Callable[[bytes, str], object] | None]] = {}
    for record in _read_records(path):
        if isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, Channel) and record.id not in channels:
            topic, encoding, name, decoder = record.topic, record.message_encoding, "", None
            try:
                name, decoder = _find_decoder(schemas.get(record.schema_id), encoding)
            except LogError as error:
                topics.refused[topic] = LogError(f"{path}: topic '{topic}' {error}")
            if topics.uses(topic, name) and encoding not in ENCODINGS:
                topics.others[f"{topic} in {encoding}, which is not read"] = None
            channels[record.id] = topic, name, decoder
        elif isinstance(record, Message):
            topic, name, decode = channels[record.channel_id]
            if decode is None:
                topics.others[topic] = None
            elif topics.uses(topic, name):
                yield topic, name, record.log_time, decode(unpack(record.data), name)
            elif topic not in topics.listed:
                topics.add(topic, partial(decode, unpack(record.data), name))


def _find_decoder(schema: Schema | None, encoding: str) -> tuple[str, Callable[[bytes, str], object] | None]:
    """Find the type of messages, and the function that decodes them; None if their encoding or type is unknown."""
    name = schema.name if schema else ""
    name = name.replace("/", "/msg/") if name.count("/") == 1 else name  # ROS 1 omits the middle part
    if encoding == "json":
        return name, lambda data, _: json.loads(data, object_hook=lambda values: SimpleNamespace(**values))
    if schema and encoding == "protobuf":
        return open_protobuf(schema)
    with suppress(Exception) if name not in READ else nullcontext():  # definitions that are not used may be wrong
        if schema and encoding in ENCODINGS:
            store = _find_store(schema, name, encoding)
            return name, store.deserialize_cdr if encoding == "cdr" else store.deserialize_ros1
    return name, None


def _read_records(path: Path) -> Iterator[McapRecord]:
    """Read the records of an MCAP file in order, checking all checksums; the index is not needed."""
    with path.open("rb") as file:
        size = path.stat().st_size if path.is_file() else IN_MEMORY_LIMIT
        reader = StreamReader(file, emit_chunks=True, validate_crcs=True, record_size_limit=size)
        for record in reader.records:
            if isinstance(record, Chunk):
                yield from breakup_chunk(_unpack_chunk(record, path), validate_crc=True)
            else:
                yield record


def _unpack_chunk(chunk: Chunk, path: Path) -> Chunk:
    """Unpack a chunk, at most to the size that it declares."""
    check_size(str(path), chunk.uncompressed_size)
    unpack: dict[str, Callable[[bytes, int], bytes]] = {
        "zstd": _unpack,
        "lz4": lambda data, most: lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=most),
        "": lambda data, _: data,
    }
    if chunk.compression not in unpack:
        raise ValueError(f"compression '{chunk.compression}' is not supported; expected zstd or lz4")
    data = unpack[chunk.compression](chunk.data, chunk.uncompressed_size + 1)
    if len(data) != chunk.uncompressed_size:
        raise ValueError(f"a chunk does not have the declared {chunk.uncompressed_size} bytes")
    return replace(chunk, compression="", data=data)


@cache
def _types() -> Typestore:
    """Build a store with the types of ROS 2 and the published definitions of others."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, definition in DEFINITIONS.items():
        store.register(get_types_from_msg(definition, name))
    return store


def _find_store(schema: Schema, name: str, encoding: str) -> Typestore:
    """Build a store with the type of an MCAP channel: from ROS, the file itself, or the published definitions."""
    store = get_typestore(Stores.ROS2_HUMBLE if encoding == "cdr" else Stores.ROS1_NOETIC)
    if name not in store.types and schema.encoding in ("ros1msg", "ros2msg") and schema.data:
        store.register(get_types_from_msg(schema.data.decode(), name))
    return store if name in store.types else _types()
