"""Content of each message type: joints, IMU, wrench or flag; also of types in protobuf that have the same fields."""

import tomllib
from collections import Counter
from collections.abc import Callable, MutableMapping, MutableSequence, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from mcap.records import Schema

from stribeck.core.errors import LogError, one_line
from stribeck.core.log.channels import VECTOR_CHANNELS
from stribeck.io.readers.unitree import FEET, MOTOR


@dataclass(frozen=True)
class Part:
    """Part of a message: joint names, nonempty values by channel."""

    labels: tuple[str, ...]
    values: dict[str, Any]
    topic: str = ""  # instead of the message's


JOINT_FIELDS = {"position": "position", "velocity": "velocity", "effort": "torque"}
"""Field of a message of joints -> channel."""


def _joint_state(message: Any, place: str) -> list[Part]:
    names = tuple(message.name)
    values = {channel: getattr(message, field, ()) for field, channel in JOINT_FIELDS.items()}
    values = {channel: numbers for channel, numbers in values.items() if len(numbers)}
    refuse_twice(names, place)
    if uneven := [channel for channel, numbers in values.items() if len(numbers) != len(names)]:
        raise LogError(
            f"{place} has {len(names)} joint names and {len(values[uneven[0]])} values of {uneven[0]}; "
            "expected one value per name, or none"
        )
    return [Part(names, values)]


def refuse_twice(names: Sequence[str], place: str) -> None:
    """Refuse duplicate joint names."""
    if twice := [name for name, count in Counter(names).items() if count > 1]:
        raise LogError(f"{place} names joint '{twice[0]}' twice; expected each once")


def _foxglove_joints(message: Any, place: str) -> list[Part]:
    """Read a list of joints, or of sets of joints: versions of the schema differ."""
    if all(isinstance(joints.name, list) for joints in message.joints):
        return [part for joints in message.joints for part in _joint_state(joints, place)]
    lists = {key: [getattr(joint, key, None) for joint in message.joints] for key in ("name", *JOINT_FIELDS)}
    return _joint_state(SimpleNamespace(**{key: () if None in own else own for key, own in lists.items()}), place)


def _dynamic_joint_state(message: Any, place: str) -> list[Part]:
    """Make one part per set of interfaces; joints, sensors and switches have different ones."""
    names, interfaces = tuple(message.joint_names), message.interface_values
    refuse_twice(names, place)
    if len(names) != len(interfaces):
        raise LogError(f"{place} has {len(names)} joint names, but {len(interfaces)} interfaces; expected as many")
    groups: dict[tuple[str, ...], list[tuple[str, dict[str, float]]]] = {}
    for name, interface in zip(names, interfaces, strict=True):
        if len(interface.interface_names) != len(interface.values):
            raise LogError(
                f"{place} has {len(interface.interface_names)} interface names and {len(interface.values)} values "
                f"of joint '{name}'; expected one value per name"
            )
        readings = dict(zip(interface.interface_names, interface.values, strict=True))
        if "effort" in readings:  # of ros2_control's torque and effort, the latter is used
            readings["torque"] = readings["effort"]
        channels = ("position", "velocity", "acceleration", "torque", "temperature")
        if values := {channel: readings[channel] for channel in channels if channel in readings}:
            groups.setdefault(tuple(values), []).append((name, values))
    return [
        Part(tuple(name for name, _ in joints), {key: [values[key] for _, values in joints] for key in channels})
        for channels, joints in groups.items()
    ]


def _imu(message: Any, _: str) -> list[Part]:
    measured = {}
    for channel, axes in VECTOR_CHANNELS.items():
        field = channel.removeprefix("base_")
        if hasattr(message, field) and -1 not in getattr(message, f"{field}_covariance", ())[:1]:  # -1: not measured
            measured[channel] = [getattr(getattr(message, field), axis) for axis in axes]
    return [Part((), measured)]


def _wrench(message: Any, _: str) -> list[Part]:
    force, moment = message.wrench.force, message.wrench.torque
    return [Part((), {"foot_wrench": (force.x, force.y, force.z, moment.x, moment.y, moment.z)})]


def _flag(message: Any, _: str) -> list[Part]:
    return [Part((), {"contact": (float(message.data),)})]


def _low_state(message: Any, place: str) -> list[Part]:
    """Extract motors by number, and the IMU; of two temperatures, the housing's, which is nearer to the gear.

    The motors' accelerations come from a filter on board and are often zero. Foot forces are uncalibrated counts.
    """
    if getattr(message, "mode_pr", 0) != 0:
        raise LogError(
            f"{place} has mode_pr {message.mode_pr}, in which ankles are motors A and B of a parallel drive; expected "
            "mode_pr 0, in which they are pitch and roll"
        )
    motors, imu = message.motor_state, message.imu_state
    temperatures = [motor.temperature for motor in motors]
    joints = {
        "position": [motor.q for motor in motors],
        "velocity": [motor.dq for motor in motors],
        "torque": [motor.tau_est for motor in motors],
        "temperature": [reading[0] if hasattr(reading, "__len__") else reading for reading in temperatures],
    }
    w, x, y, z = imu.quaternion
    measured = {
        "base_orientation": (x, y, z, w),
        "angular_velocity": imu.gyroscope,
        "linear_acceleration": imu.accelerometer,
    }
    labels = tuple(f"{MOTOR}{number}" for number in range(len(motors)))
    forces = [Part(FEET, {"foot_force": message.foot_force})] if hasattr(message, "foot_force") else []
    return [Part(labels, joints), Part((), measured), *forces]


READ: dict[str, Callable[[Any, str], list[Part]]] = {
    "sensor_msgs/msg/JointState": _joint_state,
    "control_msgs/msg/DynamicJointState": _dynamic_joint_state,
    "unitree_go/msg/LowState": _low_state,
    "unitree_hg/msg/LowState": _low_state,
    "foxglove.JointState": _joint_state,
    "foxglove.JointStates": _foxglove_joints,
    "sensor_msgs/msg/Imu": _imu,
    "geometry_msgs/msg/WrenchStamped": _wrench,
    "std_msgs/msg/Bool": _flag,
}
"""Functions that split a message into parts, by type; their arguments are the message and its place for errors."""

JOINT_TYPES = tuple(name.replace("/msg/", "/") for name in list(READ)[:6])
"""Types with joints, as shown in error messages."""

DEFINITIONS: dict[str, str] = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
"""Published definitions of types outside ROS, for bags without definitions."""

SHAPES = {
    "sensor_msgs/msg/JointState": {"name[]", "position[]"},
    "foxglove.JointStates": {"joints[].name", "joints[].position"},
    "sensor_msgs/msg/Imu": {"angular_velocity.x", "linear_acceleration.x"},
    "geometry_msgs/msg/WrenchStamped": {"wrench.force", "wrench.torque"},
}
"""Type that is read -> fields of messages that are read like it, whatever their type's name; lists end with []."""


def open_protobuf(schema: Schema) -> tuple[str, Callable[[bytes, str], object]]:
    """Find the type that messages are read like, and the function that decodes them.

    Raises
    ------
    LogError
        If the package protobuf is missing, or the schema does not define the type; for the topic's name to be added.
    """
    try:
        from google.protobuf import descriptor_database, descriptor_pb2, descriptor_pool, message_factory
    except ImportError as error:
        raise LogError("is in protobuf, which needs the package protobuf: pip install 'stribeck[protobuf]'") from error
    database = descriptor_database.DescriptorDatabase()
    try:
        for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
            database.Add(file)
        kind = descriptor_pool.DescriptorPool(database).FindMessageTypeByName(schema.name)
    except Exception as error:  # damaged bytes, or a missing type or import
        raise LogError(
            f"is in protobuf, and its schema does not define its type '{schema.name}' ({one_line(str(error))[:160]}); "
            "expected a FileDescriptorSet with the type's file and all files that it imports"
        ) from error
    top = [(field, field.name + "[]" * field.is_repeated) for field in kind.fields]
    inner = [f"{name}.{part.name}" for field, name in top if field.message_type for part in field.message_type.fields]
    name = next((key for key, shape in SHAPES.items() if shape <= {*inner, *(own for _, own in top)}), schema.name)
    parse = message_factory.GetMessageClass(kind).FromString
    return name, lambda data, _: _plain(parse(data))


def _plain(value: Any) -> Any:
    """Convert a message to plain objects, without fields that are not set."""
    if hasattr(value, "DESCRIPTOR"):
        known = (field for field in value.DESCRIPTOR.fields if not field.has_presence or value.HasField(field.name))
        return SimpleNamespace(**{field.name: _plain(getattr(value, field.name)) for field in known})
    if isinstance(value, MutableMapping):
        return SimpleNamespace(**{str(key): _plain(entry) for key, entry in value.items()})
    return [_plain(entry) for entry in value] if isinstance(value, MutableSequence) else value
