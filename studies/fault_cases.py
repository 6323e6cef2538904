"""Semantic faults of a log: the change of the log and its robot, and the checks that should report it."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from stribeck import Robot
from stribeck.base.typing import Array
from stribeck.log import RobotLog

Change = Callable[[RobotLog, Robot], tuple[RobotLog, Robot]]


@dataclass(frozen=True)
class Fault:
    """Change of a log and its robot, the checks that report it, and words of the error if the log is refused."""

    apply: Change
    checks: tuple[str, ...]
    words: str = ""
    of: tuple[str, ...] = ("arm", "humanoid")


def _column(robot: Robot, nth: int = 0) -> int:
    """Choose a joint with a high load: the second joint of an arm, the knee of a leg."""
    knees = [k for k, name in enumerate(robot.joint_names) if "knee" in name]
    return (knees or [1, 2])[nth]


def _channel(name: str, change: Callable[[Any, Robot], Any]) -> Change:
    """Change a channel of the log."""

    def apply(log: RobotLog, robot: Robot) -> tuple[RobotLog, Robot]:
        changed: dict[str, Any] = {name: change(getattr(log, name).copy(), robot)}
        return replace(log, **changed), robot

    return apply


def _torques(change: Callable[[Array], Array]) -> Change:
    return _channel("torque", lambda torque, _: change(torque))


def _one(change: Callable[[Array], Array], channel: str = "torque") -> Change:
    """Change a channel of one joint."""

    def of_joint(values: Array, robot: Robot) -> Array:
        values[:, _column(robot)] = change(values[:, _column(robot)])
        return values

    return _channel(channel, of_joint)


def _swapped(torque: Array, robot: Robot) -> Array:
    a, b = _column(robot), _column(robot, 1)
    torque[:, [a, b]] = torque[:, [b, a]]
    return torque


def _mirrored(torque: Array, robot: Robot) -> Array:
    names = list(robot.joint_names)
    order = [names.index(_other(name)) if _other(name) in names else k for k, name in enumerate(names)]
    return torque[:, order]


def _other(name: str) -> str:
    return name.replace("left", "#").replace("right", "left").replace("#", "right")


def _late(log: RobotLog, robot: Robot) -> tuple[RobotLog, Robot]:
    return replace(log, torque=CubicSpline(log.time, log.torque)(log.time - 0.008)), robot


def _outside(position: Array, robot: Robot) -> Array:
    _, high = robot.position_limits
    limited = [k for k in (_column(robot), _column(robot, 1)) if np.isfinite(high[k])]
    for k in limited[:1]:
        position[:, k] += high[k] - np.median(position[:, k]) + 0.5
    return position


def _wrapped(values: Array) -> Array:
    return np.where(values > np.median(values), values - 2 * np.pi, values)


def _frozen(values: Array) -> Array:
    return np.where(np.arange(len(values)) < len(values) // 2, values, values[len(values) // 2])


def _frozen_moving(values: Array) -> Array:
    """Freeze a position in the second half, where the joint moves."""
    speed, middle = np.abs(np.diff(values)), len(values) // 2
    start = middle + int(np.argmax(speed[middle:] > np.percentile(speed, 60)))
    return np.where(np.arange(len(values)) < start, values, values[start])


def _held(values: Array) -> Array:
    return values[np.arange(len(values)) // 10 * 10]


def _clipped(values: Array) -> Array:
    return np.clip(values, *np.percentile(values, [5, 95]))


def _gravity(log: RobotLog, robot: Robot) -> tuple[RobotLog, Robot]:
    model = pin.Model(robot.tree.model)
    model.gravity.linear = -robot.gravity
    return log, replace(robot, gravity=-robot.gravity, tree=replace(robot.tree, model=model))


def _falls(log: RobotLog, robot: Robot) -> tuple[RobotLog, Robot]:
    assert log.base_orientation is not None
    angle = np.clip((log.time - 0.8 * log.time[-1]) / 0.5, 0, 1)[:, None] * [0.0, np.pi / 2, 0.0]
    turned = Rotation.from_quat(log.base_orientation) * Rotation.from_rotvec(angle)
    return replace(log, base_orientation=turned.as_quat()), robot


def _lost(log: RobotLog, robot: Robot) -> tuple[RobotLog, Robot]:
    torque = log.torque.copy()
    period = (log.time[-1] - log.time[0]) / (len(log.time) - 1)
    block = np.floor(log.time / (60 * period)).astype(int)
    torque[np.random.default_rng(3).random(block.max() + 1)[block] < 0.4] = np.nan
    return replace(log, torque=torque), robot


def _stuck(value: bool) -> Change:
    def first(contact: NDArray[np.bool_], _: Robot) -> NDArray[np.bool_]:
        contact[len(contact) // 8 :, 0] = value
        return contact

    return _channel("contact", first)


YAW = Rotation.from_euler("z", 90, degrees=True)
WALK, EVERYWHERE = ("humanoid",), ("arm", "humanoid", "turntable", "standing")
FAULTS = {
    "one torque inverted": Fault(_one(np.negative), ("torque-sign",)),
    "all torques inverted": Fault(_torques(np.negative), ("torque-sign",)),
    "torques in mN m": Fault(
        _torques(lambda x: 1e3 * x), ("torque-scale",), of=("arm", "humanoid", "turntable", "standing")
    ),
    "torques in kgf m": Fault(_torques(lambda x: x / 9.81), ("torque-scale",), of=("arm", "humanoid", "standing")),
    "amperes read as N m": Fault(
        _torques(lambda x: x * np.random.default_rng(4).uniform(0.03, 0.15, x.shape[1])), ("torque-scale",)
    ),
    "one torque off by two": Fault(_one(lambda x: 2 * x), ("torque-gain",)),
    "one torque half": Fault(_one(lambda x: x / 2), ("torque-gain",)),
    "a gear ratio left out": Fault(_one(lambda x: x / 100), ("torque-gain",)),
    "torques without a sign": Fault(_torques(np.abs), ("torque-unsigned",)),
    "one torque without a sign": Fault(_one(np.abs), ("torque-unsigned",)),
    "torques 8 ms late": Fault(_late, ("torque-delay",)),
    "two torques swapped": Fault(_channel("torque", _swapped), ("joints-swapped",)),
    "left and right torques swapped": Fault(_channel("torque", _mirrored), ("joints-swapped",), of=WALK),
    "a position jumps by a turn": Fault(_one(_wrapped, "position"), ("position-jump",)),
    "positions in degrees": Fault(_channel("position", lambda x, _: np.rad2deg(x)), ("position-degrees",)),
    "a position outside its limits": Fault(_channel("position", _outside), ("position-limits",)),
    "a position frozen halfway": Fault(_one(_frozen_moving, "position"), ("channel-frozen",)),
    "a torque frozen halfway": Fault(_one(_frozen), ("channel-frozen",)),
    "a dead torque": Fault(_one(np.zeros_like), ("channel-dead",)),
    "a clipped torque": Fault(_one(_clipped), ("channel-clipped",)),
    "a torque held for 10 samples": Fault(_one(_held), ("channel-held",)),
    "a clock twice too fast": Fault(_channel("time", lambda x, _: 2.0 * x), ("clock",)),
    "a clock twice too slow": Fault(_channel("time", lambda x, _: 0.5 * x), ("clock",)),
    "gravity upside down": Fault(_gravity, ("gravity",), "[robot] gravity"),
    "many samples lost": Fault(_lost, ("samples-lost",)),
    "quaternion wxyz": Fault(
        _channel("base_orientation", lambda q, _: q[:, [3, 0, 1, 2]]), ("base-orientation",), 'order = "wxyz"', WALK
    ),
    "quaternion inverted": Fault(
        _channel("base_orientation", lambda q, _: q * [-1, -1, -1, 1]), ("quaternion-inverse",), of=WALK
    ),
    "IMU turned by 90 degrees": Fault(
        _channel("base_orientation", lambda q, _: (Rotation.from_quat(q) * YAW).as_quat()), ("imu-axes",), of=WALK
    ),
    "gyroscope axes exchanged": Fault(
        _channel("angular_velocity", lambda w, _: w[:, [1, 0, 2]]), ("imu-axes",), of=WALK
    ),
    "accelerometer inverted": Fault(_channel("linear_acceleration", lambda a, _: -a), ("imu-axes",), of=WALK),
    "contacts swapped": Fault(_channel("contact", lambda c, _: c[:, ::-1]), ("contacts-swapped",), of=WALK),
    "a contact stuck on": Fault(_stuck(True), ("contact-stuck",), of=WALK),
    "a contact stuck off": Fault(_stuck(False), ("contact-stuck",), of=WALK),
    "the robot falls": Fault(_falls, ("base-falls",), of=WALK),
}
"""Faults by name; every log with one of them can still be read."""
