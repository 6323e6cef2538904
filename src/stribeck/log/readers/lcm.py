"""LCM event logs, as `lcm-logger` writes them: messages of the types that are known here by their fingerprints."""

import re
import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from stribeck.errors import LogError
from stribeck.log.readers.join import join
from stribeck.log.readers.messages import Part, refuse_twice
from stribeck.log.readers.source import Source, foreign
from stribeck.log.readers.topics import collect
from stribeck.settings import LogTable

EVENT = struct.Struct(">IqqII")
"""Before each event: a sign, its number, the recorder's stamp [us], and the lengths of channel and message."""
SIGN = 0xEDA1DA01
MAGIC = SIGN.to_bytes(4, "big")
"""What a log begins with; `lcm-logger` gives it no suffix of its own."""
MICRO = 1_000  # [ns]

TYPES = {
    "lcmt_iiwa_status": """int64_t utime; int32_t num_joints;
        double joint_position_measured[num_joints]; double joint_velocity_estimated[num_joints];
        double joint_position_commanded[num_joints]; double joint_position_ipo[num_joints];
        double joint_torque_measured[num_joints]; double joint_torque_commanded[num_joints];
        double joint_torque_external[num_joints]""",
    "lcmt_panda_status": """int64_t utime; int32_t num_joints;
        double joint_position[num_joints]; double joint_position_desired[num_joints];
        double joint_velocity[num_joints]; double joint_velocity_desired[num_joints];
        double joint_acceleration_desired[num_joints];
        double joint_torque[num_joints]; double joint_torque_desired[num_joints];
        double joint_torque_external[num_joints];
        double control_command_success_rate; int8_t robot_mode; int64_t robot_utime;
        boolean position_control_enabled; boolean velocity_control_enabled; boolean torque_control_enabled""",
    "lcmt_robot_output": """int64_t timestamp; int32_t num_positions; int32_t num_velocities; int32_t num_efforts;
        string position_names[num_positions]; double position[num_positions];
        string velocity_names[num_velocities]; double velocity[num_velocities];
        string effort_names[num_efforts]; double effort[num_efforts]; double imu_accel[3]""",
    "robot_state_t": """int64_t utime; position_3d_t pose; twist_t twist; int16_t num_joints;
        string joint_name[num_joints]; float joint_position[num_joints]; float joint_velocity[num_joints];
        float joint_effort[num_joints]; force_torque_t force_torque""",
    "joint_state_t": """int64_t utime; int16_t num_joints; string joint_name[num_joints];
        float joint_position[num_joints]; float joint_velocity[num_joints]; float joint_effort[num_joints]""",
    "leg_control_data_lcmt": "float q[12]; float qd[12]; float p[12]; float v[12]; float tau_est[12]",
    "position_3d_t": "vector_3d_t translation; quaternion_t rotation",
    "twist_t": "vector_3d_t linear_velocity; vector_3d_t angular_velocity",
    "vector_3d_t": "double x; double y; double z",
    "quaternion_t": "double w; double x; double y; double z",
    "force_torque_t": """float l_foot_force_z; float l_foot_torque_x; float l_foot_torque_y;
        float r_foot_force_z; float r_foot_torque_x; float r_foot_torque_y;
        float l_hand_force[3]; float l_hand_torque[3]; float r_hand_force[3]; float r_hand_torque[3]""",
}
"""Published types: of Drake, of DAIR Lab's Cassie, of the bot_core collection, and of MIT's Cheetah."""
PRIMITIVES = {
    "int8_t": ">i1",
    "int16_t": ">i2",
    "int32_t": ">i4",
    "int64_t": ">i8",
    "boolean": ">i1",
    "float": ">f4",
    "double": ">f8",
    "string": "",
}


@dataclass(frozen=True)
class Field:
    """A field of a type, of one dimension at most: "" for none, a number, or the name of the field that counts it."""

    kind: str
    name: str
    length: str


def open_lcm(path: Path, table: LogTable) -> Source:
    """Open an event log; its channels are chosen as topics are.

    Raises
    ------
    LogError
        If it is damaged, or no message of a known type is in it.
    """
    others: dict[str, None] = {}
    with foreign(str(path), "an LCM log"):
        streams = collect(_messages(path, others), str(path), READ)
    return join(str(path), streams, tuple(others), table, tuple(READ))


def _messages(path: Path, others: dict[str, None]) -> Iterator[tuple[str, str, int, Any]]:
    """Give channel, type, recorder's stamp [ns] and content of the messages that are read; note the other channels."""
    known = {fingerprint(name).to_bytes(8, "big"): name for name in READ}
    size = path.stat().st_size
    with path.open("rb") as file:
        while file.tell() < size:
            start = file.tell()
            head = file.read(EVENT.size)
            sign, _, stamp, *lengths = EVENT.unpack(head.ljust(EVENT.size, b"\0"))
            if sign != SIGN:
                raise LogError(
                    f"{path}: holds no event at byte {start}; expected an LCM event log, whole and unchanged"
                )
            if len(head) < EVENT.size or file.tell() + sum(lengths) > size:
                raise LogError(f"{path}: ends within the event at byte {start}; expected a log that was closed")
            channel, data = file.read(lengths[0]).decode(), file.read(lengths[1])
            if data[:8] not in known:
                others[channel] = None
                continue
            message, end = _decode(known[data[:8]], data, 8, f"{path}: the event at byte {start}")
            if end != len(data):
                raise LogError(f"{path}: the event at byte {start} has {len(data)} bytes of data; expected {end}")
            message.stamp = MICRO * getattr(message, "utime", getattr(message, "timestamp", 0))
            yield channel, known[data[:8]], MICRO * stamp, message


def _decode(kind: str, data: bytes, place: int, where: str) -> tuple[SimpleNamespace, int]:
    """Return a message, and where it ends in the data."""
    message = SimpleNamespace()
    for field in _fields(kind):
        length = getattr(message, field.length) if field.length.isidentifier() else int(field.length or 1)
        value: Any
        if field.kind == "string":
            value = []
            for _ in range(length):
                (size,) = struct.unpack_from(">i", data, place)
                place += 4 + size
                if size < 1 or place > len(data):
                    raise LogError(
                        f"{where} has a text of {size} bytes in '{field.name}'; expected one that fits in it"
                    )
                value.append(data[place - size : place].rstrip(b"\0").decode())
        elif field.kind in PRIMITIVES:
            dtype = np.dtype(PRIMITIVES[field.kind])
            if length < 0 or place + length * dtype.itemsize > len(data):
                raise LogError(
                    f"{where} has {length} values in '{field.name}' and {len(data) - place} bytes left for them; "
                    f"expected {dtype.itemsize} bytes a value"
                )
            value = np.frombuffer(data, dtype, length, place)
            place += length * dtype.itemsize
        else:
            value, place = _decode(field.kind, data, place, where)
        setattr(message, field.name, value.item() if field.kind in PRIMITIVES and not field.length else value)
    return message, place


@cache
def _fields(kind: str) -> tuple[Field, ...]:
    matches = [re.fullmatch(r"\s*(\w+)\s+(\w+)\s*(?:\[(\w+)\])?\s*", one) for one in TYPES[kind].split(";")]
    return tuple(Field(match[1], match[2], match[3] or "") for match in matches if match)


def fingerprint(kind: str) -> int:
    """Return the number that LCM puts before each message of a type, made from its fields' names, types and sizes."""

    def rotated(value: int) -> int:
        return (value << 1 | value >> 63) & MASK

    def total(name: str) -> int:
        return rotated((_base(name) + sum(total(f.kind) for f in _fields(name) if f.kind not in PRIMITIVES)) & MASK)

    return total(kind)


MASK = (1 << 64) - 1


def _base(kind: str) -> int:
    """Return a type's own part of its fingerprint, as lcm-gen makes it."""
    value = 0x12345678

    def add(number: int) -> None:
        nonlocal value
        signed = value - (value >> 63 << 64)
        value = ((signed << 8) ^ (signed >> 55)) + number & MASK

    def add_text(text: str) -> None:
        add(len(text))
        for letter in text.encode():
            add(letter)

    for field in _fields(kind):
        add_text(field.name)
        if field.kind in PRIMITIVES:
            add_text(field.kind)
        add(int(bool(field.length)))
        if field.length:
            add(int(field.length.isidentifier()))
            add_text(field.length)
    return value


def _numbers(count: int) -> tuple[str, ...]:
    return tuple(str(number) for number in range(count))


def _iiwa(message: Any, _: str) -> list[Part]:
    values = {
        "position": message.joint_position_measured,
        "velocity": message.joint_velocity_estimated,
        "torque": message.joint_torque_measured,
    }
    return [Part("joints", _numbers(message.num_joints), values)]


def _panda(message: Any, _: str) -> list[Part]:
    values = {"position": message.joint_position, "velocity": message.joint_velocity, "torque": message.joint_torque}
    return [Part("joints", _numbers(message.num_joints), values)]


def _robot_output(message: Any, where: str) -> list[Part]:
    """Return joints, whose velocities end in `dot` and motors in `_motor`, and the base, whose places begin with it."""
    parts = []
    for channel, names, values, ending in (
        ("position", message.position_names, message.position, ""),
        ("velocity", message.velocity_names, message.velocity, "dot"),
        ("torque", message.effort_names, message.effort, "_motor"),
    ):
        own = [place for place, name in enumerate(names) if not name.startswith("base_")]
        labels = tuple(names[place].removesuffix(ending) for place in own)
        refuse_twice(labels, where)
        parts.append(Part("joints", labels, {channel: values[own]} if own else {}))
    base = dict(zip(message.position_names, message.position, strict=True))
    imu: dict[str, Sequence[float]] = {"linear_acceleration": message.imu_accel}
    if all(f"base_q{axis}" in base for axis in "xyzw"):
        imu["base_orientation"] = [base[f"base_q{axis}"] for axis in "xyzw"]
    return [*parts, Part("imu", (), imu)]


def _joint_state(message: Any, where: str) -> list[Part]:
    refuse_twice(message.joint_name, where)
    values = {
        "position": message.joint_position,
        "velocity": message.joint_velocity,
        "torque": message.joint_effort,
    }
    return [Part("joints", tuple(message.joint_name), values)]


def _robot_state(message: Any, where: str) -> list[Part]:
    turned = message.pose.rotation
    orientation = {"base_orientation": (turned.x, turned.y, turned.z, turned.w)}
    return [*_joint_state(message, where), Part("imu", (), orientation)]


def _legs(message: Any, _: str) -> list[Part]:
    values = {"position": message.q, "velocity": message.qd, "torque": message.tau_est}
    return [Part("joints", _numbers(len(message.q)), values)]


READ: dict[str, Callable[[Any, str], list[Part]]] = {
    "lcmt_iiwa_status": _iiwa,
    "lcmt_panda_status": _panda,
    "lcmt_robot_output": _robot_output,
    "robot_state_t": _robot_state,
    "joint_state_t": _joint_state,
    "leg_control_data_lcmt": _legs,
}
"""Types that are read, and how."""
