"""rosbag2 folders (SQLite or MCAP inside) and ROS 1 `.bag` files, read without ROS."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from stribeck.log.readers.join import join
from stribeck.log.readers.source import Source, foreign
from stribeck.log.readers.topics import KINDS, collect
from stribeck.settings import LogTable


def open_rosbag(path: Path, table: LogTable) -> Source:
    """Open a bag with joint states, and with IMU, foot wrench and contact messages where it has them.

    Raises
    ------
    LogError
        If it is damaged, or holds no joint states.
    """
    what = "a rosbag2 folder" if path.is_dir() else "a ROS 1 bag"
    with (
        foreign(str(path), what),
        AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader,
    ):
        streams = collect(_messages(reader), str(path))
        others = sorted({connection.topic for connection in reader.connections if connection.msgtype not in KINDS})
    return join(str(path), streams, others, table)


def _messages(reader: AnyReader) -> Iterator[tuple[str, str, int, Any]]:
    """Give topic, type, recorder's stamp [ns] and content of the messages that are read."""
    connections = [connection for connection in reader.connections if connection.msgtype in KINDS]
    if not connections:  # to AnyReader, an empty choice means everything
        return
    for connection, recorded, data in reader.messages(connections=connections):
        yield connection.topic, connection.msgtype, recorded, reader.deserialize(data, connection.msgtype)
