"""Small arm with a revolute, a continuous and a prismatic joint, and logs of it with known friction."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array
from stribeck.core.friction import get_law
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot

URDF = (Path(__file__).parent / "arm.urdf").read_text()
TRUTH = {"viscous": 0.3, "coulomb": 1.2, "stribeck_gain": 0.25, "stribeck_velocity": 0.2, "offset": -0.4, "slope": 40.0}


def write_arm(folder: Path, text: str = "") -> Path:
    """Write model and robot file to a folder, and return the path of the robot file."""
    (folder / "arm.urdf").write_text(URDF)
    path = folder / "robot.toml"
    path.write_text(f'[robot]\nmodel = "arm.urdf"\nbase = "fixed"\n{text}')
    return path


def sines(
    generator: np.random.Generator, time: Array, joints: int, fastest: float, sizes: tuple[float, float], count: int
) -> Array:
    """Draw sums of sines per joint: position, velocity and acceleration, shape (3, T, n)."""
    motion = np.zeros((3, len(time), joints))
    for joint in range(joints):
        for omega in 2 * np.pi * generator.uniform(0.3, fastest, count):
            size, phase = generator.uniform(*sizes) / omega, generator.uniform(0, 6.28)
            motion[0, :, joint] += size * np.sin(omega * time + phase)
            motion[1, :, joint] += size * omega * np.cos(omega * time + phase)
            motion[2, :, joint] -= size * omega**2 * np.sin(omega * time + phase)
    return motion


def needed_torque(robot: Robot, position: Array, velocity: Array, acceleration: Array) -> Array:
    """Compute the torques [N m] that a motion of a fixed robot needs without friction, by Pinocchio, shape (T, n)."""
    model, data = robot.tree.model, robot.tree.model.createData()
    return np.array([pin.rnea(model, data, *row) for row in zip(position, velocity, acceleration, strict=True)])


def stribeck_torque(velocity: Array, truth: Mapping[str, float] = TRUTH) -> Array:
    """Compute the friction torques of the law (3.5) at velocities of any shape."""
    law = get_law("stribeck")
    values = np.array([truth[parameter.name] for parameter in law.parameters])
    return law.torque(velocity.ravel(), values).reshape(velocity.shape)


def arm_log(robot: Robot, duration: float = 20.0, rate: float = 1000.0, seed: int = 0, still: str = "") -> RobotLog:
    """Make a log with exact motion, whose torques are Pinocchio's plus the law (3.5) with `TRUTH` in every joint."""
    time = np.arange(round(duration * rate)) / rate
    motion = sines(np.random.default_rng(seed), time, len(robot.joint_names), 1.6, (0.3, 0.6), 4)
    position, velocity, acceleration = motion * (np.array(robot.joint_names) != still)
    return RobotLog(
        time=time,
        joint_names=robot.joint_names,
        position=position,
        velocity=velocity,
        acceleration=acceleration,
        torque=needed_torque(robot, position, velocity, acceleration) + stribeck_torque(velocity),
    )


def save_npz(log: RobotLog, path: Path, **changed: object) -> Path:
    """Write a log's channels under their standard names; some are changed, or omitted if None."""
    feet = np.array(log.foot_names) if log.foot_names else None
    names = {"joint_names": np.array(log.joint_names), "foot_names": feet}
    arrays: dict[str, object] = {**log.channels(), **names, **changed}
    np.savez(path, **{name: array for name, array in arrays.items() if array is not None})
    return path
