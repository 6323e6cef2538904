"""Content of each message type: joints, IMU, wrench or flag."""

import tomllib
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stribeck.core.errors import LogError
from stribeck.io.readers.unitree import FEET, MOTOR


@dataclass(frozen=True)
class Part:
    """Part of a message: kind, joint names, nonempty values by channel."""

    kind: str  # "joints", "imu", "wrench", "force" or "flag"
    labels: tuple[str, ...]
    values: dict[str, Any]
    topic: str = ""  # instead of the message's


def _joint_state(message: Any, place: str) -> list[Part]:
    names = tuple(message.name)
    values = {"position": message.position, "velocity": message.velocity, "torque": message.effort}
    values = {channel: numbers for channel, numbers in values.items() if len(numbers)}
    refuse_twice(names, place)
    if uneven := [channel for channel, numbers in values.items() if len(numbers) != len(names)]:
        raise LogError(
            f"{place} has {len(names)} joint names and {len(values[uneven[0]])} values of {uneven[0]}; "
            "expected one value per name, or none"
        )
    return [Part("joints", names, values)]


def refuse_twice(names: Sequence[str], place: str) -> None:
    """Refuse duplicate joint names."""
    if twice := [name for name, count in Counter(names).items() if count > 1]:
        raise LogError(f"{place} names joint '{twice[0]}' twice; expected each once")


def _foxglove_joints(message: Any, place: str) -> list[Part]:
    names = tuple(joint.name for joint in message.joints)
    refuse_twice(names, place)
    channels = {"position": "position", "velocity": "velocity", "torque": "effort"}
    read = {channel: [getattr(joint, key, None) for joint in message.joints] for channel, key in channels.items()}
    return [Part("joints", names, {channel: values for channel, values in read.items() if None not in values})]


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
        Part(
            "joints",
            tuple(name for name, _ in joints),
            {channel: [values[channel] for _, values in joints] for channel in channels},
        )
        for channels, joints in groups.items()
    ]


def _imu(message: Any, _: str) -> list[Part]:
    rotation, speed, push = message.orientation, message.angular_velocity, message.linear_acceleration
    parts = {
        "base_orientation": (message.orientation_covariance, (rotation.x, rotation.y, rotation.z, rotation.w)),
        "angular_velocity": (message.angular_velocity_covariance, (speed.x, speed.y, speed.z)),
        "linear_acceleration": (message.linear_acceleration_covariance, (push.x, push.y, push.z)),
    }
    measured = {name: part for name, (covariance, part) in parts.items() if covariance[0] != -1}  # -1: not measured
    return [Part("imu", (), measured)]


def _wrench(message: Any, _: str) -> list[Part]:
    force, moment = message.wrench.force, message.wrench.torque
    return [Part("wrench", (), {"foot_wrench": (force.x, force.y, force.z, moment.x, moment.y, moment.z)})]


def _flag(message: Any, _: str) -> list[Part]:
    return [Part("flag", (), {"contact": (float(message.data),)})]


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
    forces = [Part("force", FEET, {"foot_force": message.foot_force})] if hasattr(message, "foot_force") else []
    return [Part("joints", labels, joints), Part("imu", (), measured), *forces]


READ: dict[str, Callable[[Any, str], list[Part]]] = {
    "sensor_msgs/msg/JointState": _joint_state,
    "control_msgs/msg/DynamicJointState": _dynamic_joint_state,
    "unitree_go/msg/LowState": _low_state,
    "unitree_hg/msg/LowState": _low_state,
    "foxglove.JointStates": _foxglove_joints,
    "sensor_msgs/msg/Imu": _imu,
    "geometry_msgs/msg/WrenchStamped": _wrench,
    "std_msgs/msg/Bool": _flag,
}
"""Functions that split a message into parts, by type; their arguments are the message and its place for errors."""

JOINT_TYPES = tuple(name.replace("/msg/", "/") for name in list(READ)[:5])
"""Types with joints, as shown in error messages."""

DEFINITIONS: dict[str, str] = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
"""Published definitions of types outside ROS, for bags without definitions."""
