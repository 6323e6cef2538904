"""MCAP files of ROS 2 messages: joint states, IMU, and wrench and contact of every foot."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import Writer
from rosbags.typesys import Stores, get_typestore

from stribeck.log.readers.topics import NANO
from stribeck.log.robot_log import RobotLog

WITHOUT_PLACE = ("acceleration", "temperature", "external_torque", "foot_force")
NOT_MEASURED = np.array([-1.0, *[0.0] * 8])
"""Covariance of a part of an IMU message that holds nothing."""


def write_mcap(log: RobotLog, path: Path) -> list[str]:
    """Write a log as messages, and return which of its channels no message has a place for."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="stribeck")
        channels: dict[str, int] = {}
        for topic, kind, stamp, message in _messages(log, store.types):
            if topic not in channels:
                definition, _ = store.generate_msgdef(kind, ros_version=2)
                schema = writer.register_schema(kind, "ros2msg", definition.encode())
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            writer.add_message(channels[topic], stamp, bytes(store.serialize_cdr(message, kind)), stamp)
        writer.finish()  # type: ignore[no-untyped-call]
    return [name for name in WITHOUT_PLACE if getattr(log, name) is not None]


def _messages(log: RobotLog, types: Any) -> Iterator[tuple[str, str, int, Any]]:
    """Give topic, type, stamp [ns] and content of every message; stamps count from zero at the earliest."""
    vector, none = types["geometry_msgs/msg/Vector3"], np.empty(0)
    stamps = np.round((log.time - min(log.time[0], 0.0)) * NANO).astype(np.int64)
    for row, stamp in enumerate(stamps.tolist()):
        time = types["builtin_interfaces/msg/Time"](sec=stamp // NANO, nanosec=stamp % NANO)
        header = types["std_msgs/msg/Header"](stamp=time, frame_id="")
        kind = "sensor_msgs/msg/JointState"
        velocity = none if log.velocity is None else log.velocity[row]
        joints = types[kind](
            header=header,
            name=list(log.joint_names),
            position=log.position[row],
            velocity=velocity,
            effort=log.torque[row],
        )
        yield "/joint_states", kind, stamp, joints
        imu = {
            "orientation": (log.base_orientation, types["geometry_msgs/msg/Quaternion"], [0.0, 0.0, 0.0, 1.0]),
            "angular_velocity": (log.angular_velocity, vector, [0.0, 0.0, 0.0]),
            "linear_acceleration": (log.linear_acceleration, vector, [0.0, 0.0, 0.0]),
        }
        if any(channel is not None for channel, _, _ in imu.values()):
            kind, parts = "sensor_msgs/msg/Imu", {}
            for name, (channel, build, nothing) in imu.items():
                parts[name] = build(*(nothing if channel is None else channel[row].tolist()))
                parts[f"{name}_covariance"] = NOT_MEASURED if channel is None else np.zeros(9)
            yield "/imu", kind, stamp, types[kind](header=header, **parts)
        for foot, name in enumerate(log.foot_names):
            if log.foot_wrench is not None:
                kind, wrench = "geometry_msgs/msg/WrenchStamped", log.foot_wrench[row, foot].tolist()
                both = types["geometry_msgs/msg/Wrench"](force=vector(*wrench[:3]), torque=vector(*wrench[3:]))
                yield f"/foot_wrench/{name}", kind, stamp, types[kind](header=header, wrench=both)
            if log.contact is not None:
                kind = "std_msgs/msg/Bool"
                yield f"/contact/{name}", kind, stamp, types[kind](data=bool(log.contact[row, foot]))
