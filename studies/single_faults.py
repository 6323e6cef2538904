"""Single faults of a log or of the real robot, and the checks or the causes in a list that name them."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from stribeck import Robot
from stribeck.base.typing import Array
from stribeck.log import RobotLog
from studies.fault_cases import DELAY, Change, late, torques, turned, with_channel


def _same_robot(robot: Robot) -> Robot:
    return robot


@dataclass(frozen=True)
class SingleFault:
    """Fault of a log or of the real robot, the checks that name it, and words of a list of causes that contains it."""

    change: Change = lambda log, robot: (log, robot)
    checks: tuple[str, ...] = ()
    words: tuple[str, ...] = ()
    of_robot: Callable[[Robot], Robot] = _same_robot
    column: int | None = None
    of: tuple[str, ...] = ("arm", "walk")

    def of_log(self, log: RobotLog, robot: Robot) -> RobotLog:
        """Put the fault into a log."""
        return self.change(log, robot)[0]

    def joints(self, robot: Robot) -> tuple[str, ...]:
        """List the joints that a finding should name; empty if any."""
        return () if self.column is None else (robot.joint_names[self.column],)


def _only(column: int, change: Callable[[Array], Array], channel: str = "torque") -> Change:
    def of_joint(values: Array, _: Robot) -> Array:
        values[:, column] = change(values[:, column])
        return values

    return with_channel(channel, of_joint)


def _with_body(place: int, mass: float, factor: float = 1.0) -> Callable[[Robot], Robot]:
    """Add a mass [kg] 5 cm off the center of a body, or make it heavier by a factor."""

    def of_robot(robot: Robot) -> Robot:
        model = pin.Model(robot.tree.model)
        joint = range(model.njoints)[place]
        own = model.inertias[joint]
        added = pin.Inertia(mass, own.lever + 0.05 * np.eye(3)[2], 1e-3 * mass * np.eye(3))
        model.inertias[joint] = pin.Inertia(factor * own.mass, own.lever, factor * own.inertia) + added
        return replace(robot, tree=replace(robot.tree, model=model))

    return of_robot


def _tilted(degrees: float) -> Callable[[Robot], Robot]:
    def of_robot(robot: Robot) -> Robot:
        model = pin.Model(robot.tree.model)
        gravity = Rotation.from_euler("x", degrees, degrees=True).apply(robot.gravity)
        model.gravity.linear = gravity
        return replace(robot, gravity=gravity, tree=replace(robot.tree, model=model))

    return of_robot


def _one_way(log: RobotLog, robot: Robot) -> tuple[RobotLog, Robot]:
    """Negate a torque while its joint moves backwards."""
    torque = log.torque.copy()
    torque[:, 1] *= np.where(np.gradient(log.position[:, 1]) < 0, -1.0, 1.0)
    return replace(log, torque=torque), robot


SCALES, GAIN, BODY, UNIT = ("torque-scale",), ("torque-gain",), ("payload", "bodies-differ"), ("position-degrees",)
ONE_GAIN, GAINS, BODIES = (
    ("one gain of all torques", "by one factor"),
    ("gains of torques", "torque-gain:"),
    ("a body: ",),
)
SINGLE_FAULTS = {
    "none": SingleFault(),
    "all torques x 1.3": SingleFault(torques(lambda x: 1.3 * x), SCALES, ONE_GAIN),
    "all torques x 0.8": SingleFault(torques(lambda x: 0.8 * x), SCALES, ONE_GAIN),
    "all torques x 1.12": SingleFault(torques(lambda x: 1.12 * x), SCALES, ONE_GAIN),
    "one torque x 1.3": SingleFault(_only(1, lambda x: 1.3 * x), GAIN, GAINS, column=1),
    "one torque x 1.1": SingleFault(_only(1, lambda x: 1.1 * x), GAIN, GAINS, column=1),
    "last torque x 1.25": SingleFault(_only(-1, lambda x: 1.25 * x), GAIN, GAINS, column=-1),
    "last torque x 0.7": SingleFault(_only(-1, lambda x: 0.7 * x), GAIN, GAINS, column=-1),
    "two torques x 1.4": SingleFault(
        torques(lambda x: x * np.where(np.arange(x.shape[1]) // 2 == 1, 1.4, 1.0)), GAIN, GAINS
    ),
    "a gear ratio left out": SingleFault(_only(2, lambda x: x / 100), GAIN, column=2),
    "torques in mN m": SingleFault(torques(lambda x: 1e3 * x), SCALES),
    "torques in kgf m": SingleFault(torques(lambda x: x / 9.80665), SCALES, ("kgf m",)),
    "torques in N cm": SingleFault(torques(lambda x: 100 * x), SCALES),
    "amperes read as N m": SingleFault(
        torques(lambda x: x / np.resize([11.0, 8.0, 14.0, 5.0], x.shape[1])), (), ("currents",)
    ),
    "positions in degrees": SingleFault(with_channel("position", lambda x, _: np.rad2deg(x)), UNIT, ('unit = "deg"',)),
    "positions in turns": SingleFault(with_channel("position", lambda x, _: x / (2 * np.pi)), (), ('unit = "turn"',)),
    "velocities in degrees": SingleFault(with_channel("velocity", lambda x, _: np.rad2deg(x)), (), ('unit = "deg/s"',)),
    "velocities in rpm": SingleFault(with_channel("velocity", lambda x, _: 30 / np.pi * x), (), ('unit = "rpm"',)),
    "all torques inverted": SingleFault(torques(np.negative), ("torque-sign",)),
    "one torque inverted": SingleFault(_only(1, np.negative), ("torque-sign",), column=1),
    "one position inverted": SingleFault(
        _only(1, np.negative, "position"), ("position-limits", "torque-sign", "encoder-zero")
    ),
    "a torque without a sign": SingleFault(_only(-1, np.abs), ("torque-unsigned",), column=-1),
    "a torque negated one way": SingleFault(_one_way, ("torque-unsigned",), column=1),
    "torques 8 ms late": SingleFault(late(0.008), DELAY),
    "one torque 10 ms late": SingleFault(
        _only(1, lambda x: np.append(np.full(2, x[0]), x[:-2])), DELAY, ("delay",), column=1
    ),
    "a clock twice too fast": SingleFault(with_channel("time", lambda x, _: 2.0 * x), ("clock",), ("[log.time]",)),
    "a clock twice too slow": SingleFault(with_channel("time", lambda x, _: 0.5 * x), ("clock",), ("[log.time]",)),
    "two torques swapped": SingleFault(
        with_channel("torque", lambda x, _: x[:, [0, 2, 1, *range(3, x.shape[1])]]), ("joints-swapped",)
    ),
    "encoder off by 5°": SingleFault(
        _only(2, lambda x: x + np.deg2rad(5), "position"), ("encoder-zero",), ("encoder-zero",)
    ),
    "a dead torque": SingleFault(_only(2, np.zeros_like), ("channel-dead",), column=2),
    "2 kg at the last body": SingleFault(of_robot=_with_body(-1, 2.0), checks=BODY, words=BODIES, of=("arm",)),
    "2 kg on the base": SingleFault(of_robot=_with_body(1, 2.0), checks=(*BODY, *SCALES), words=BODIES, of=("walk",)),
    "a body twice as heavy": SingleFault(of_robot=_with_body(3, 0.0, 2.0), checks=BODY, words=BODIES),
    "base tilted by 10°": SingleFault(of_robot=_tilted(10), checks=("gravity",), words=("tilted",), of=("arm",)),
    "IMU pitched by 10°": SingleFault(turned("y", 10), ("imu-tilt", "base-orientation"), ("imu-tilt",), of=("walk",)),
    "contacts swapped": SingleFault(
        with_channel("contact", lambda c, _: c[:, [1, 0, 3, 2]]), ("contacts-swapped",), of=("walk",)
    ),
}
"""Faults of the first hour, by name."""
