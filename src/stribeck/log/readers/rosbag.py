"""rosbag2 folders (SQLite or MCAP inside), ROS 1 `.bag` and single `.mcap` files, read without ROS."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from stribeck.log.readers.intact import check_mcap, check_sqlite
from stribeck.log.readers.join import join
from stribeck.log.readers.source import Source, foreign
from stribeck.log.readers.topics import KINDS, collect
from stribeck.settings import LogTable

CHECKS: dict[str, Callable[[Path], None]] = {".mcap": check_mcap, ".db3": check_sqlite}


def open_rosbag(path: Path, table: LogTable) -> Source:
    """Open a bag with joint states, and with IMU, foot wrench and contact messages where it has them.

    Raises
    ------
    LogError
        If it is damaged, or holds no joint states.
    """
    what = "a rosbag2 folder" if path.is_dir() else "a ROS 1 bag"
    with foreign(str(path), what):
        for file in _bag_files(path):
            CHECKS[file.suffix](file)
    with (
        foreign(str(path), what),
        AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader,
    ):
        streams = collect(_messages(reader), str(path))
        others = sorted({connection.topic for connection in reader.connections if connection.msgtype not in KINDS})
    return join(str(path), streams, others, table)


def _bag_files(path: Path) -> list[Path]:
    """Return the files of a rosbag2 that can be checked: those of its folder that its metadata names."""
    if not path.is_dir():
        return []
    metadata = (path / "metadata.yaml").read_text(encoding="utf-8", errors="replace")
    return [file for file in sorted(path.iterdir()) if file.suffix in CHECKS and file.name in metadata]


def _messages(reader: AnyReader) -> Iterator[tuple[str, str, int, Any]]:
    """Give topic, type, recorder's stamp [ns] and content of the messages that are read."""
    connections = [connection for connection in reader.connections if connection.msgtype in KINDS]
    if not connections:  # to AnyReader, an empty choice means everything
        return
    for connection, recorded, data in reader.messages(connections=connections):
        yield connection.topic, connection.msgtype, recorded, reader.deserialize(data, connection.msgtype)


def open_mcap(path: Path, table: LogTable) -> Source:
    """Open an MCAP file with joint states, and with IMU, foot wrench and contact messages where it has them.

    Raises
    ------
    LogError
        If it is damaged, or holds no joint states.
    """
    others: dict[str, None] = {}
    with foreign(str(path), "MCAP"):
        check_mcap(path)
        streams = collect(_mcap_messages(path, others), str(path))
    return join(str(path), streams, tuple(others), table)


def _mcap_messages(path: Path, others: dict[str, None]) -> Iterator[tuple[str, str, int, Any]]:
    """Give topic, type, recorder's stamp [ns] and content of the messages that are read; note the other topics."""
    decoders: dict[str, Callable[[bytes, str], Any]] = {
        "cdr": get_typestore(Stores.ROS2_HUMBLE).deserialize_cdr,
        "ros1": get_typestore(Stores.ROS1_NOETIC).deserialize_ros1,
    }
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            kind = _kind(schema.name) if schema else ""
            if kind in KINDS and channel.message_encoding in decoders:
                content = decoders[channel.message_encoding](message.data, kind)
                yield channel.topic, kind, message.log_time, content
            else:
                others[channel.topic] = None


def _kind(name: str) -> str:
    """Return a message type's ROS 2 name; ROS 1 leaves the middle part out."""
    return name if name.count("/") != 1 else name.replace("/", "/msg/")
