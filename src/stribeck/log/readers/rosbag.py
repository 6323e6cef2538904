"""rosbag2 folders (SQLite or MCAP inside), ROS 1 `.bag` and single `.mcap` files, read without ROS."""

from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from mcap.records import Schema
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from stribeck.log.readers.intact import check_mcap, check_sqlite
from stribeck.log.readers.join import join
from stribeck.log.readers.messages import DEFINITIONS, JOINT_TYPES, READ
from stribeck.log.readers.source import Source, foreign
from stribeck.log.readers.topics import collect
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
        AnyReader([path], default_typestore=_store()) as reader,
    ):
        streams = collect(_messages(reader), str(path), READ)
        others = sorted({connection.topic for connection in reader.connections if connection.msgtype not in READ})
    return join(str(path), streams, others, table, JOINT_TYPES)


def _bag_files(path: Path) -> list[Path]:
    """Return the files of a rosbag2 that can be checked: those of its folder that its metadata names."""
    if not path.is_dir():
        return []
    metadata = (path / "metadata.yaml").read_text(encoding="utf-8", errors="replace")
    return [file for file in sorted(path.iterdir()) if file.suffix in CHECKS and file.name in metadata]


def _messages(reader: AnyReader) -> Iterator[tuple[str, str, int, Any]]:
    """Give topic, type, recorder's stamp [ns] and content of the messages that are read."""
    connections = [connection for connection in reader.connections if connection.msgtype in READ]
    if not connections:  # to AnyReader, an empty choice means everything
        return
    there = reader.typestore.fielddefs
    if not {connection.msgtype for connection in connections} <= there.keys():  # some bags define only some types
        reader.typestore.register({name: kind for name, kind in _store().fielddefs.items() if name not in there})
    for connection, recorded, data in reader.messages(connections=connections):
        yield connection.topic, connection.msgtype, recorded, reader.deserialize(data, connection.msgtype)


@cache
def _store() -> Typestore:
    """Return the types of ROS 2, and the published definitions of others that are read."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, definition in DEFINITIONS.items():
        store.register(get_types_from_msg(definition, name))
    return store


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
        streams = collect(_mcap_messages(path, others), str(path), READ)
    return join(str(path), streams, tuple(others), table, JOINT_TYPES)


def _mcap_messages(path: Path, others: dict[str, None]) -> Iterator[tuple[str, str, int, Any]]:
    """Give topic, type, recorder's stamp [ns] and content of the messages that are read; note the other topics."""
    stores: dict[int, Typestore] = {}
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            name = _kind(schema.name) if schema else ""
            if schema is None or name not in READ or channel.message_encoding not in ("cdr", "ros1"):
                others[channel.topic] = None
                continue
            if channel.id not in stores:
                stores[channel.id] = _store_of(schema, name, channel.message_encoding)
            store = stores[channel.id]
            decode = store.deserialize_cdr if channel.message_encoding == "cdr" else store.deserialize_ros1
            yield channel.topic, name, message.log_time, decode(message.data, name)


def _store_of(schema: Schema, name: str, encoding: str) -> Typestore:
    """Return a store with the type of an MCAP channel: ROS's own, or as the file itself or its makers define it."""
    own = get_typestore(Stores.ROS2_HUMBLE if encoding == "cdr" else Stores.ROS1_NOETIC)
    if name not in own.types and schema.encoding in ("ros1msg", "ros2msg") and schema.data:
        own.register(get_types_from_msg(schema.data.decode(), name))
    return own if name in own.types else _store()


def _kind(name: str) -> str:
    """Return a message type's ROS 2 name; ROS 1 leaves the middle part out."""
    return name if name.count("/") != 1 else name.replace("/", "/msg/")
