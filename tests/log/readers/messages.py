"""Messages of robots, and MCAP files and bags of them."""

import numpy as np
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from rosbags import rosbag2
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from stribeck.io.readers.messages import DEFINITIONS

START = 1_700_000_000_000_000_000  # of recordings [ns]
ROS1 = get_typestore(Stores.ROS1_NOETIC)


def store_with(definitions):
    """Make a store of ROS 2 types with further ones."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in definitions.items():
        store.register(get_types_from_msg(text, name))
    return store


STORE = store_with(DEFINITIONS)


def blank(kind, stamp=None, store=STORE, **values):
    """Make a message of zeros with some other values and, if it has a header, a stamp [ns]."""
    message = store.types[kind](**{field: _blank(own, store) for field, own in store.fielddefs[kind][1]})
    if hasattr(message, "header"):
        seconds, nanoseconds = divmod(int(stamp or 0), 10**9)
        message.header.stamp = store.types["builtin_interfaces/msg/Time"](sec=seconds, nanosec=nanoseconds)
    for name, value in values.items():
        setattr(message, name, value)
    return message


def _blank(kind, store):
    node, what = kind
    if node == Nodetype.NAME:
        return blank(what, store=store)
    if node == Nodetype.BASE:
        return "" if what[0] == "string" else 0
    (inner, name), length = what
    if node == Nodetype.SEQUENCE:
        return []
    return [blank(name, store=store) for _ in range(length)] if inner == Nodetype.NAME else np.zeros(length, name[0])


def messages_of(log, store=STORE):
    """Convert a log to (topic, message type, stamp [ns], message), as a robot would send them."""
    vector, quaternion = (store.types[f"geometry_msgs/msg/{name}"] for name in ("Vector3", "Quaternion"))

    def sent(topic, kind, stamp, **values):
        return topic, kind, stamp, blank(kind, stamp, store, **values)

    for row, stamp in enumerate((START + np.round(log.time * 1e9).astype(np.int64)).tolist()):
        channels = {"position": log.position, "velocity": log.velocity, "effort": log.torque}
        state = {name: values[row] for name, values in channels.items()} | {"name": list(log.joint_names)}
        yield sent("/joint_states", "sensor_msgs/msg/JointState", stamp, **state)
        if log.base_orientation is not None:
            rates = ("angular_velocity", "linear_acceleration")
            imu = {name: vector(*getattr(log, name)[row].tolist()) for name in rates}
            imu["orientation"] = quaternion(*log.base_orientation[row].tolist())
            yield sent("/imu", "sensor_msgs/msg/Imu", stamp, **imu)
        for f, foot in enumerate(log.foot_names):
            force, torque = (vector(*part) for part in log.foot_wrench[row, f].reshape(2, 3).tolist())
            wrench = store.types["geometry_msgs/msg/Wrench"](force=force, torque=torque)
            yield sent(f"/sensors/{foot}_ft", "geometry_msgs/msg/WrenchStamped", stamp, wrench=wrench)
            yield sent(f"/contacts/{foot}", "std_msgs/msg/Bool", stamp, data=bool(log.contact[row, f]))


def write_messages(path, messages, store=STORE, define=True, chunked=True):
    """Write (topic, type, stamp, message) as an MCAP file, with or without type definitions."""
    ros1 = store is ROS1
    serialize = store.serialize_ros1 if ros1 else store.serialize_cdr
    with path.open("wb") as file:
        writer = McapWriter(file, compression=CompressionType.NONE, use_chunking=chunked, enable_data_crcs=not chunked)
        writer.start(profile="" if ros1 else "ros2")
        channels = {}
        for topic, kind, stamp, message in messages:
            if topic not in channels:
                name = kind.replace("/msg/", "/") if ros1 else kind
                text = store.generate_msgdef(kind, ros_version=1 if ros1 else 2)[0] if define else ""
                encoding = ("ros1msg" if ros1 else "ros2msg") if define else ""
                schema = writer.register_schema(name, encoding, text.encode())
                channels[topic] = writer.register_channel(topic, "ros1" if ros1 else "cdr", schema)
            writer.add_message(channels[topic], int(stamp), bytes(serialize(message, kind)), int(stamp))
        writer.finish()
    return path


def write_bag(path, messages, store=STORE, version=9, plugin=rosbag2.StoragePlugin.SQLITE3, compression=None):
    """Write (topic, type, stamp, message) as a bag of ROS 2; version 8 has no type definitions."""
    writer = rosbag2.Writer(path, version=version, storage_plugin=plugin)
    if compression:
        writer.set_compression(compression, rosbag2.CompressionFormat.ZSTD)
    send(writer, messages, store, store.serialize_cdr)
    return path


def send(writer, messages, store, serialize):
    """Write (topic, type, stamp, message) by the writer of a bag."""
    with writer:
        connections = {}
        for topic, kind, stamp, message in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], int(stamp), serialize(message, kind))


def write_as(inside, define, folder, messages):
    """Write an MCAP file or, `inside` a "rosbag2", a bag, with or without type definitions."""
    if inside == "mcap":
        return write_messages(folder / "log.mcap", messages, define=define)
    return write_bag(folder / "bag", messages, version=9 if define else 8)
