"""Faults of a log or of the real robot, and the checks or the causes in a list that should name them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.ndimage import uniform_filter1d
from scipy.signal import butter, lfilter, savgol_filter
from scipy.spatial.transform import Rotation

from stribeck import Robot
from stribeck.core.base.typing import Array
from stribeck.core.dynamics.rooted import RootMotion, rooted_inverse_dynamics
from stribeck.core.dynamics.state import root_quaternions
from stribeck.core.log import RobotLog
from stribeck.core.robot.kinematics import direction_in_root
from stribeck.core.robot.rooting import BASE_FRAME
from studies.changes import earlier, heaviest, known, period_of, with_body, with_model

Change = Callable[[RobotLog, Robot], RobotLog]
KNEES = ("left_knee", "right_knee", "leg_left_4_joint", "leg_right_4_joint")
LEFT_LEG = ("leg_left", "left_hip", "left_knee", "left_ankle")


def _same_robot(robot: Robot) -> Robot:
    return robot


@dataclass(frozen=True)
class Fault:
    """Change of a log and of its robot's description, and what should report it.

    Attributes
    ----------
    of_log
        Changes the log.
    checks
        Checks that name the fault.
    words
        Words that name it in a refusal or in a list of causes.
    of
        Logs that it is put into: `arm`, `walk` and `G1` in the study, `panda` and `talos` in the tests of the audit.
    column
        Joint that the findings should name.
    of_robot
        Changes the real robot.
    of_model
        Changes the robot's description.
    """

    of_log: Change = lambda log, _: log
    checks: tuple[str, ...] = ()
    words: tuple[str, ...] = ()
    of: str = "arm walk"
    column: int | None = None
    of_robot: Callable[[Robot], Robot] = _same_robot
    of_model: Callable[[Robot], Robot] = _same_robot

    def apply(self, log: RobotLog, robot: Robot) -> tuple[RobotLog, Robot]:
        """Change a log and its robot's description."""
        return self.of_log(log, robot), self.of_model(robot)

    def joints(self, robot: Robot) -> tuple[str, ...]:
        """List the joints that a finding should name; empty if any."""
        return () if self.column is None else (robot.joint_names[self.column],)


def _column(robot: Robot, nth: int = 0) -> int:
    """Choose a joint with a high load: the second joint of an arm or of a quadruped, the knee of a humanoid."""
    knees = [k for k, name in enumerate(robot.joint_names) if name.startswith(KNEES)]
    return (knees or [1, 2])[nth]


def with_channel(name: str, change: Callable[[Any, Robot], Any]) -> Change:
    """Change a channel of the log."""
    return lambda log, robot: replace(log, **{name: change(getattr(log, name).copy(), robot)})


def every(name: str, change: Callable[[Any], Any]) -> Change:
    """Change a channel of all joints, whatever the robot."""
    return with_channel(name, lambda values, _: change(values))


def torques(change: Callable[[Array], Array]) -> Change:
    return every("torque", change)


def _one(change: Callable[[Array], Array], channel: str = "torque", column: int | None = None) -> Change:
    """Change a channel of one joint, the one with a high load if no column is given."""

    def of_joint(values: Array, robot: Robot) -> Array:
        own = _column(robot) if column is None else column
        values[:, own] = change(values[:, own])
        return values

    return with_channel(channel, of_joint)


def _swapped(torque: Array, robot: Robot) -> Array:
    a, b = _column(robot), _column(robot, 1)
    torque[:, [a, b]] = torque[:, [b, a]]
    return torque


def _mirrored(torque: Array, robot: Robot) -> Array:
    names = list(robot.joint_names)
    others = [name.replace("left", "#").replace("right", "left").replace("#", "right") for name in names]
    return torque[:, [names.index(other) if other in names else k for k, other in enumerate(others)]]


def late(seconds: float, channel: str = "torque") -> Change:
    def of_log(log: RobotLog, _: Robot) -> RobotLog:
        values: Any = CubicSpline(log.time, getattr(log, channel))((log.time - seconds).clip(*log.time[[0, -1]]))
        return replace(log, **{channel: values > 0.5 if channel == "contact" else values})

    return of_log


def _one_late(log: RobotLog, robot: Robot) -> RobotLog:
    """Delay the torque of one joint by 10 ms."""
    return _one(lambda torque: torque[earlier(log, 0.01)])(log, robot)


def _clock(log: RobotLog, _: Robot) -> RobotLog:
    """Let the clock of the torques run 1 % slow."""
    return replace(log, torque=CubicSpline(log.time, log.torque)(log.time[0] + 0.99 * (log.time - log.time[0])))


def _low_pass(hertz: float, joints: slice | None = None) -> Change:
    """Filter torques as a drive does: first order, causal; those of one joint if `joints` is None."""

    def of_log(log: RobotLog, robot: Robot) -> RobotLog:
        own = joints or slice(_column(robot), _column(robot) + 1)
        coefficients = butter(1, hertz, fs=1 / period_of(log))
        torque = log.torque.copy()
        torque[:, own] = lfilter(*coefficients, torque[:, own] - torque[0, own], axis=0) + torque[0, own]
        return replace(log, torque=torque)

    return of_log


def _averaged(seconds: float) -> Change:
    """Log means of the torques over the past."""

    def of_log(log: RobotLog, _: Robot) -> RobotLog:
        rows = round(seconds / period_of(log))
        return replace(log, torque=uniform_filter1d(log.torque, rows, axis=0, origin=rows // 2 - 1, mode="nearest"))

    return of_log


def _rotors(log: RobotLog, _: Robot) -> RobotLog:
    """Measure torques in front of rotors of 0.1 kg m^2 that the model lacks."""
    return replace(log, torque=log.torque + 0.1 * savgol_filter(log.position, 61, 4, deriv=2, delta=1e-3, axis=0))


def _compensated(log: RobotLog, robot: Robot) -> RobotLog:
    """Log torques of hips and knees without the part by which the drives compensate friction."""
    speed = savgol_filter(log.position, 61, 4, deriv=1, delta=1e-3, axis=0)
    own = np.array([any(part in name for part in ("hip", "knee", "leg")) for name in robot.joint_names])
    own &= ~np.array([name.endswith(("5_joint", "6_joint")) for name in robot.joint_names])  # ankles
    return replace(log, torque=log.torque - 0.2 * own * np.tanh(speed / 0.05))


def _driving(log: RobotLog, robot: Robot) -> RobotLog:
    """Walk on a platform that starts and stops with up to 1 m/s^2."""
    contact, push = known(log.contact), np.outer(np.sin(2 * np.pi * 0.3 * log.time), [-1.0, 0.0, 0.0])
    turned = Rotation.from_quat(root_quaternions(robot, log.position, known(log.base_orientation)))
    torque, still = log.torque.copy(), np.zeros_like(log.position)
    for k, foot in enumerate(log.foot_names):
        rows = contact[:, k] & ~contact[:, :k].any(axis=1)
        rooted, position = robot.rooted_at(foot), log.position[rows]
        pull = direction_in_root(
            rooted, rooted.model.getFrameId(BASE_FRAME), position, turned[rows].apply(push[rows], inverse=True)
        )
        torque[rows] += rooted_inverse_dynamics(rooted, position, still[rows], still[rows], RootMotion(pull))[1]
    return replace(log, torque=torque)


def turned(axis: str, degrees: float | list[float]) -> Change:
    turn = Rotation.from_euler(axis, degrees, degrees=True)
    return every("base_orientation", lambda q: (Rotation.from_quat(q) * turn).as_quat())


def _y_up(orientation: Array) -> Array:
    return (Rotation.from_euler("x", -90, degrees=True) * Rotation.from_quat(orientation)).as_quat()


def _degrees(position: Array, robot: Robot) -> Array:
    """Log degrees, with one joint a little beyond its limit."""
    knee, high = _column(robot), robot.position_limits[1]
    position[:, knee] += high[knee] + 0.109 - position[:, knee].max()
    return np.rad2deg(position)


def _side(torque: Array, robot: Robot) -> Array:
    torque[:, [name.startswith(LEFT_LEG) for name in robot.joint_names]] *= 1.2
    return torque


def _leaking(torque: Array, robot: Robot) -> Array:
    """Let a tenth of the torque of one knee show in the torque of the hip above."""
    torque[:, _column(robot) - 1] += 0.1 * torque[:, _column(robot)]
    return torque


def _exchanged(log: RobotLog, robot: Robot) -> RobotLog:
    """Count the legs in the order right, left, rear right, rear left."""
    left, right = ([k for k, name in enumerate(robot.joint_names) if f"_{side}_" in name] for side in ("left", "right"))
    order = np.arange(len(robot.joint_names))
    order[left], order[right] = right, left
    channels = ("position", "velocity", "acceleration", "torque")
    other: dict[str, Any] = {name: values[:, order] for name in channels if (values := getattr(log, name)) is not None}
    return replace(log, **other, contact=known(log.contact)[:, np.arange(len(log.foot_names)) ^ 1])


def _outside(position: Array, robot: Robot) -> Array:
    _, high = robot.position_limits
    for k in [k for k in (_column(robot), _column(robot, 1)) if np.isfinite(high[k])][:1]:
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


def _falls(log: RobotLog, _: Robot) -> RobotLog:
    angle = np.clip((log.time - 0.8 * log.time[-1]) / 0.5, 0, 1)[:, None] * [0.0, np.pi / 2, 0.0]
    turned = Rotation.from_quat(known(log.base_orientation)) * Rotation.from_rotvec(angle)
    return replace(log, base_orientation=turned.as_quat())


def _lost(log: RobotLog, _: Robot) -> RobotLog:
    torque = log.torque.copy()
    block = np.floor(log.time / (60 * period_of(log))).astype(int)
    torque[np.random.default_rng(3).random(block.max() + 1)[block] < 0.4] = np.nan
    return replace(log, torque=torque)


def _stuck(value: bool) -> Change:
    def first(contact: NDArray[np.bool_], _: Robot) -> NDArray[np.bool_]:
        contact[len(contact) // 8 :, 0] = value
        return contact

    return with_channel("contact", first)


def _one_way(log: RobotLog, _: Robot) -> RobotLog:
    """Negate a torque while its joint moves backwards."""
    torque = log.torque.copy()
    torque[:, 1] *= np.where(np.gradient(log.position[:, 1]) < 0, -1.0, 1.0)
    return replace(log, torque=torque)


def _without_payload(robot: Robot) -> Robot:
    """Leave 5 kg of the heaviest body out of the model."""
    return with_body(
        robot, heaviest(robot), lambda own: pin.Inertia(own.mass - 5.0, own.lever, own.inertia * (1 - 5.0 / own.mass))
    )


def _with_body(place: int, mass: float, factor: float = 1.0) -> Callable[[Robot], Robot]:
    """Add a mass [kg] 5 cm off the center of a body, or make it heavier by a factor."""

    def change(own: pin.Inertia) -> pin.Inertia:
        added = pin.Inertia(mass, own.lever + 0.05 * np.eye(3)[2], 1e-3 * mass * np.eye(3))
        return pin.Inertia(factor * own.mass, own.lever, factor * own.inertia) + added

    return lambda robot: with_body(robot, range(robot.tree.model.njoints)[place], change)


def _with_gravity(change: Callable[[Array], Array]) -> Callable[[Robot], Robot]:
    def of_robot(robot: Robot) -> Robot:
        gravity = change(robot.gravity)
        return replace(with_model(robot, lambda model: setattr(model.gravity, "linear", gravity)), gravity=gravity)

    return of_robot


SCALE, GAIN, BODY = ("torque-scale",), ("torque-gain",), ("payload", "bodies-differ")
DELAY, DEAD, ZERO = ("torque-delay", "friction-delay"), ("channel-dead",), ("encoder-zero",)
FILTERED, UNSIGNED, SWAPPED = ("torque-filtered",), ("torque-unsigned",), ("joints-swapped",)
SIGN, STUCK, AXES, CLOCK = ("torque-sign",), ("contact-stuck",), ("imu-axes",), ("[log.time]",)
ONE_GAIN, GAINS = ("one gain of all torques", "by one factor"), ("gains of torques", "torque-gain:")
BODIES, MISREAD = ("a body: ",), ("position-sign", "position-limits")
CLIPPED, IN_DEGREES = ("channel-clipped",), ("position-degrees",)
ALL, KNOWN, EVERY = "arm walk G1", "arm walk panda", "arm walk G1 panda"
FAULTS = {
    "none": Fault(of=ALL),
    # Gains and units of torques
    "all torques x 1.3": Fault(torques(lambda x: 1.3 * x), SCALE, ONE_GAIN, ALL),
    "all torques x 0.8": Fault(torques(lambda x: 0.8 * x), SCALE, ONE_GAIN, ALL),
    "all torques x 1.12": Fault(torques(lambda x: 1.12 * x), SCALE, ONE_GAIN),
    "one torque x 1.3": Fault(_one(lambda x: 1.3 * x), GAIN, GAINS, ALL, column=1),
    "one torque x 1.1": Fault(_one(lambda x: 1.1 * x), GAIN, GAINS, ALL, column=1),
    "last torque x 1.25": Fault(_one(lambda x: 1.25 * x, column=-1), GAIN, GAINS, column=-1),
    "last torque x 0.7": Fault(_one(lambda x: 0.7 * x, column=-1), GAIN, GAINS, column=-1),
    "two torques x 1.4": Fault(torques(lambda x: x * np.where(np.arange(x.shape[1]) // 2 == 1, 1.4, 1)), GAIN, GAINS),
    "one leg x 1.2": Fault(with_channel("torque", _side), GAIN, of="G1"),
    "one torque off by two": Fault(_one(lambda x: 2 * x), GAIN, of="panda"),
    "one torque half": Fault(_one(lambda x: x / 2), GAIN, of="panda"),
    "a gear ratio left out": Fault(_one(lambda x: x / 100, column=2), GAIN, column=2),
    "the gear ratio of a loaded joint left out": Fault(_one(lambda x: x / 100), GAIN, of="G1 panda"),
    "torques in mN m": Fault(torques(lambda x: 1e3 * x), SCALE, of=KNOWN),
    "torques in kgf m": Fault(torques(lambda x: x / 9.80665), SCALE, ("kgf m",), EVERY),
    "torques in N cm": Fault(torques(lambda x: 100 * x), SCALE),
    "amperes read as N m": Fault(
        torques(lambda x: x / np.resize([11.0, 8.0, 14.0, 5.0], x.shape[1])), (), ("currents",)
    ),
    # Signs
    "all torques inverted": Fault(torques(np.negative), SIGN, of=KNOWN),
    "one torque inverted": Fault(_one(np.negative), SIGN, of=EVERY, column=1),
    "one position inverted": Fault(_one(np.negative, "position"), MISREAD, of="arm walk G1 panda talos"),
    "torques without a sign": Fault(torques(np.abs), UNSIGNED, of="G1 panda"),
    "one torque without a sign": Fault(_one(np.abs), UNSIGNED, of="panda"),
    "a torque without a sign": Fault(_one(np.abs, column=-1), UNSIGNED, column=-1),
    "a torque negated one way": Fault(_one_way, UNSIGNED, column=1),
    # Joints
    "two torques swapped": Fault(with_channel("torque", _swapped), SWAPPED, of=EVERY),
    "left and right torques swapped": Fault(with_channel("torque", _mirrored), SWAPPED, of="G1 talos"),
    # Time
    "torques 8 ms late": Fault(late(0.008), DELAY, of=KNOWN),
    "torques 0.4 s late": Fault(late(0.4), DELAY, of=KNOWN),
    "torques averaged over 0.2 s": Fault(_averaged(0.2), FILTERED, of="panda"),
    "torques 2 ms late": Fault(late(0.002), DELAY, of="G1"),
    "one torque 10 ms late": Fault(_one_late, DELAY, ("delay",), ALL, column=1),
    "torque clock 1 % off": Fault(_clock, ("torque-clock",), of="G1 talos"),
    "torques low-passed at 3 Hz": Fault(_low_pass(3.0, slice(None)), FILTERED, of="G1 talos"),
    "torques low-passed at 10 Hz": Fault(_low_pass(10.0, slice(None)), FILTERED + DELAY, of="G1"),
    "one torque low-passed at 3 Hz": Fault(_low_pass(3.0), FILTERED + DELAY, of="G1"),
    "a clock twice too fast": Fault(every("time", lambda x: 2.0 * x), ("clock",), CLOCK, KNOWN),
    "a clock twice too slow": Fault(every("time", lambda x: 0.5 * x), ("clock",), CLOCK, KNOWN),
    # Channels
    "a dead torque": Fault(_one(np.zeros_like, column=2), DEAD, column=2),
    "a torque of zero": Fault(_one(np.zeros_like), DEAD, of="G1 panda"),
    "a constant torque": Fault(_one(lambda x: np.full_like(x, 5.0)), DEAD, of="G1"),
    "a torque of noise": Fault(
        _one(lambda x: 0.1 * np.random.default_rng(7).standard_normal(len(x))), DEAD, of="G1 talos"
    ),
    "a torque frozen halfway": Fault(_one(_frozen), ("channel-frozen",), of="G1 panda"),
    "a torque held for 10 samples": Fault(
        _one(lambda x: x[np.arange(len(x)) // 10 * 10]), ("channel-held",), of="G1 panda"
    ),
    "a clipped torque": Fault(_one(lambda x: np.clip(x, *np.percentile(x, [5, 95]))), CLIPPED, of="panda"),
    "torques clipped": Fault(torques(lambda x: np.clip(x, -0.6 * x.max(), 0.6 * x.max())), CLIPPED, of="G1"),
    "torques quantized to 2 N m": Fault(torques(lambda x: 2 * np.round(x / 2)), ("channel-coarse",), of="G1 talos"),
    "many samples lost": Fault(_lost, ("samples-lost",), of="panda"),
    "spikes in torques": Fault(
        torques(lambda x: x + 20.0 * (np.random.default_rng(6).random(x.shape) < 5e-4)), of="G1"
    ),
    "one torque off by 10 N m": Fault(_one(lambda x: x + 10), of="G1"),
    "a torque that leaks": Fault(with_channel("torque", _leaking), of="G1"),
    "friction compensated": Fault(_compensated, of="G1"),
    # Positions and velocities
    "positions in degrees": Fault(every("position", np.rad2deg), IN_DEGREES, ('unit = "deg"',), KNOWN),
    "positions in turns": Fault(every("position", lambda x: x / (2 * np.pi)), (), ('unit = "turn"',)),
    "velocities in degrees": Fault(every("velocity", np.rad2deg), (), ('unit = "deg/s"',)),
    "velocities in rpm": Fault(every("velocity", lambda x: 30 / np.pi * x), (), ('unit = "rpm"',)),
    "degrees, one joint beyond its limit": Fault(with_channel("position", _degrees), IN_DEGREES, of="G1 talos"),
    "a position jumps by a turn": Fault(_one(_wrapped, "position"), ("position-jump",), of="panda"),
    "a position outside its limits": Fault(with_channel("position", _outside), ("position-limits",), of="panda"),
    "a position frozen halfway": Fault(_one(_frozen_moving, "position"), ("channel-frozen",), of="G1 panda"),
    "encoder off by 5°": Fault(_one(lambda x: x + np.deg2rad(5), "position", 2), ZERO, ZERO),
    "knee encoder off by 5°": Fault(_one(lambda x: x + np.deg2rad(5), "position"), ZERO, of="G1"),
    "knee encoder off by 1°": Fault(_one(lambda x: x + np.deg2rad(1), "position"), ZERO, of="G1"),
    "one position with a wrong scale": Fault(_one(lambda x: 1.1 * x, "position"), ZERO, of="G1"),
    # The model
    "2 kg at the last body": Fault(of_robot=_with_body(-1, 2.0), checks=BODY, words=BODIES, of="arm"),
    "2 kg on the base": Fault(of_robot=_with_body(1, 2.0), checks=BODY + SCALE, words=BODIES, of="walk"),
    "a body twice as heavy": Fault(of_robot=_with_body(3, 0.0, 2.0), checks=BODY, words=BODIES),
    "5 kg not in the model": Fault(of_model=_without_payload, checks=("bodies-differ", "torque-scale"), of="G1"),
    "rotors missing in the model": Fault(_rotors, ("rotor-missing",), of="G1"),
    "gravity upside down": Fault(
        of_model=_with_gravity(np.negative), checks=("gravity",), words=("[robot] gravity",), of="G1 panda"
    ),
    "base tilted by 10°": Fault(
        of_robot=_with_gravity(Rotation.from_euler("x", 10, degrees=True).apply),
        checks=("gravity",),
        words=("tilted",),
        of="arm",
    ),
    # The base and its IMU
    "IMU rolled by 3°": Fault(turned("x", 3), ("imu-tilt",), of="G1"),
    "IMU pitched by 3°": Fault(turned("y", 3), ("imu-tilt",), of="G1"),
    "IMU pitched by 10°": Fault(turned("y", 10), ("imu-tilt", "base-orientation"), ("imu-tilt",), "walk G1"),
    "IMU turned by 90 degrees": Fault(turned("z", 90), AXES, of="talos"),
    "IMU in any rotation": Fault(turned("xyz", [17, -11, 69]), AXES, of="talos"),
    "vertical along y": Fault(every("base_orientation", _y_up), words=("gravity = [0.0, -9.81, 0.0]",), of="talos"),
    "gyroscope axes exchanged": Fault(every("angular_velocity", lambda w: w[:, [1, 0, 2]]), AXES, of="talos"),
    "accelerometer inverted": Fault(every("linear_acceleration", lambda a: -a), AXES, of="talos"),
    "quaternion wxyz": Fault(
        every("base_orientation", lambda q: q[:, [3, 0, 1, 2]]), ("base-orientation",), ("wxyz",), "talos"
    ),
    "quaternion inverted": Fault(
        every("base_orientation", lambda q: q * [-1, -1, -1, 1]), ("quaternion-inverse",), of="G1 talos"
    ),
    "base orientation 30 ms late": Fault(late(0.03, "base_orientation"), ("base-orientation-delay",), of="G1"),
    "ground that drives": Fault(_driving, ("base-moves",), of="G1"),
    "the robot falls": Fault(_falls, ("base-falls",), of="talos"),
    # Contacts
    "contacts swapped": Fault(
        every("contact", lambda c: c[:, np.arange(c.shape[1]) ^ 1]), ("contacts-swapped",), of="walk G1 talos"
    ),
    "legs exchanged": Fault(_exchanged, ("legs-exchanged",), of="walk"),
    "contacts 60 ms late": Fault(late(0.06, "contact"), ("contact-stuck", "contact-delay"), of="G1"),
    "a contact stuck on": Fault(_stuck(True), STUCK, of="talos"),
    "a contact stuck off": Fault(_stuck(False), STUCK, of="talos"),
}
"""Faults by name."""
