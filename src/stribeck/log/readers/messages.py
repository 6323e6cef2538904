"""Content of each message type: joints, IMU, wrench or flag."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from stribeck.errors import LogError
from stribeck.log.readers.unitree import FEET, MOTOR

INTERFACES = {
    "position": "position",
    "velocity": "velocity",
    "acceleration": "acceleration",
    "torque": "torque",
    "effort": "torque",
    "temperature": "temperature",
}
"""Interfaces of ros2_control -> channels; of two for the same channel, the later one is used."""


@dataclass(frozen=True)
class Part:
    """Part of a message: kind, joint names, and nonempty values by channel."""

    kind: str  # "joints", "imu", "wrench", "force" or "flag"
    labels: tuple[str, ...]
    values: dict[str, Any]


def _joint_state(message: Any, place: str) -> list[Part]:
    names = tuple(message.name)
    values = {"position": message.position, "velocity": message.velocity, "torque": message.effort}
    values = {channel: numbers for channel, numbers in values.items() if len(numbers)}
    refuse_twice(names, place)
    uneven = [channel for channel, numbers in values.items() if len(numbers) != len(names)]
    if uneven:
        raise LogError(
            f"{place} has {len(names)} joint names and {len(values[uneven[0]])} values of {uneven[0]}; "
            "expected one value per name, or none"
        )
    return [Part("joints", names, values)]


def refuse_twice(names: Sequence[str], place: str) -> None:
    """Refuse duplicate joint names."""
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise LogError(f"{place} names joint '{twice[0]}' twice; expected each once")


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
        found = dict(zip(interface.interface_names, interface.values, strict=True))
        values = {channel: found[key] for key, channel in INTERFACES.items() if key in found}
        if values:
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
        "temperature": [one[0] if hasattr(one, "__len__") else one for one in temperatures],
    }
    w, x, y, z = imu.quaternion
    measured = {
        "base_orientation": (x, y, z, w),
        "angular_velocity": imu.gyroscope,
        "linear_acceleration": imu.accelerometer,
    }
    labels = tuple(f"{MOTOR}{number}" for number in range(len(motors)))
    parts = [Part("joints", labels, joints), Part("imu", (), measured)]
    return (
        [*parts, Part("force", FEET, {"foot_force": message.foot_force})] if hasattr(message, "foot_force") else parts
    )


READ: dict[str, Callable[[Any, str], list[Part]]] = {
    "sensor_msgs/msg/JointState": _joint_state,
    "control_msgs/msg/DynamicJointState": _dynamic_joint_state,
    "unitree_go/msg/LowState": _low_state,
    "unitree_hg/msg/LowState": _low_state,
    "sensor_msgs/msg/Imu": _imu,
    "geometry_msgs/msg/WrenchStamped": _wrench,
    "std_msgs/msg/Bool": _flag,
}
"""Functions that split a message into parts, by type; their arguments are the message and its place for errors."""

JOINT_TYPES = tuple(name.replace("/msg/", "/") for name in list(READ)[:4])
"""Types with joints, as shown in error messages."""

DEFINITIONS = {
    "control_msgs/msg/InterfaceValue": "string[] interface_names\nfloat64[] values\n",
    "control_msgs/msg/DynamicJointState": (
        "std_msgs/Header header\nstring[] joint_names\nInterfaceValue[] interface_values\n"
    ),
    "unitree_go/msg/IMUState": (
        "float32[4] quaternion\nfloat32[3] gyroscope\nfloat32[3] accelerometer\nfloat32[3] rpy\nint8 temperature\n"
    ),
    "unitree_go/msg/MotorState": (
        "uint8 mode\nfloat32 q\nfloat32 dq\nfloat32 ddq\nfloat32 tau_est\nfloat32 q_raw\nfloat32 dq_raw\n"
        "float32 ddq_raw\nint8 temperature\nuint32 lost\nuint32[2] reserve\n"
    ),
    "unitree_go/msg/BmsState": (
        "uint8 version_high\nuint8 version_low\nuint8 status\nuint8 soc\nint32 current\nuint16 cycle\nint8[2] bq_ntc\n"
        "int8[2] mcu_ntc\nuint16[15] cell_vol\n"
    ),
    "unitree_go/msg/LowState": (
        "uint8[2] head\nuint8 level_flag\nuint8 frame_reserve\nuint32[2] sn\nuint32[2] version\nuint16 bandwidth\n"
        "IMUState imu_state\nMotorState[20] motor_state\nBmsState bms_state\nint16[4] foot_force\n"
        "int16[4] foot_force_est\nuint32 tick\nuint8[40] wireless_remote\nuint8 bit_flag\nfloat32 adc_reel\n"
        "int8 temperature_ntc1\nint8 temperature_ntc2\nfloat32 power_v\nfloat32 power_a\nuint16[4] fan_frequency\n"
        "uint32 reserve\nuint32 crc\n"
    ),
    "unitree_hg/msg/IMUState": (
        "float32[4] quaternion\nfloat32[3] gyroscope\nfloat32[3] accelerometer\nfloat32[3] rpy\nint16 temperature\n"
    ),
    "unitree_hg/msg/MotorState": (
        "uint8 mode\nfloat32 q\nfloat32 dq\nfloat32 ddq\nfloat32 tau_est\nint16[2] temperature\nfloat32 vol\n"
        "uint32[2] sensor\nuint32 motorstate\nuint32[4] reserve\n"
    ),
    "unitree_hg/msg/LowState": (
        "uint32[2] version\nuint8 mode_pr\nuint8 mode_machine\nuint32 tick\nIMUState imu_state\n"
        "MotorState[35] motor_state\nuint8[40] wireless_remote\nuint32[4] reserve\nuint32 crc\n"
    ),
}
"""Published definitions of types outside ROS, for bags without definitions."""
