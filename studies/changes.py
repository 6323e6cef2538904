"""Robots of the studies, and changes of robots and logs that several studies make."""

import sysconfig
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from stribeck import Robot
from stribeck.core.base.typing import Array
from stribeck.core.log import RobotLog
from stribeck.simulation.robots import MODELS

EXAMPLES = Path(sysconfig.get_path("purelib")) / "cmeel.prefix/share/example-robot-data/robots"
UR5 = f'[robot]\nmodel = "{EXAMPLES}/ur_description/urdf/ur5_robot.urdf"\nbase = "fixed"\n'
"""Robot file of an arm with six joints."""
T = TypeVar("T")


def known(channel: T | None) -> T:
    """Return a channel that the log or the truth must contain."""
    assert channel is not None
    return channel


def packaged(robot_file: str, model: str) -> str:
    """Read a packaged robot file, and make the path of its model absolute."""
    return (MODELS / robot_file).read_text(encoding="utf-8").replace(model, str(MODELS / model))


def robot_from(text: str) -> Robot:
    """Read a robot from the text of its robot file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.toml"
        path.write_text(text, encoding="utf-8")
        return Robot.from_file(path)


def with_model(robot: Robot, change: Callable[[pin.Model], object]) -> Robot:
    """Change a copy of the robot's model."""
    model = pin.Model(robot.tree.model)
    change(model)
    return replace(robot, tree=replace(robot.tree, model=model))


def with_body(robot: Robot, joint: int, change: Callable[[pin.Inertia], pin.Inertia]) -> Robot:
    """Change the body that a joint of the model moves."""
    return with_model(robot, lambda model: model.inertias.__setitem__(joint, change(model.inertias[joint])))


def carrying(robot: Robot, joint: int, mass: float, place: Array) -> Robot:
    """Add a point mass [kg] at a place in the frame of a joint [m]."""
    payload = pin.Inertia(mass, place, np.zeros((3, 3)))
    return with_body(robot, joint, lambda body: body + payload)


def heaviest(robot: Robot) -> int:
    """Find the index of the heaviest body in the model."""
    return max(range(1, robot.tree.model.njoints), key=lambda k: float(robot.tree.model.inertias[k].mass))


def period_of(log: RobotLog) -> float:
    """Compute the sampling period of a log [s]."""
    return float(np.median(np.diff(log.time)))


def earlier(log: RobotLog, delay: float) -> NDArray[np.int64]:
    """Compute the row that a sensor with a delay [s] shows at each sample."""
    return np.maximum(np.arange(len(log.time)) - round(delay / period_of(log)), 0)


def quantized(log: RobotLog, bits: int) -> RobotLog:
    """Round positions to the resolution of encoders with so many bits per turn; 0 bits change nothing."""
    step = 2 * np.pi / 2**bits
    return replace(log, position=step * np.round(log.position / step)) if bits else log
