"""Small arm with a revolute, a continuous and a prismatic joint, and logs of it with known friction."""

from pathlib import Path

import numpy as np
import pinocchio as pin

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


def arm_log(robot: Robot, duration: float = 20.0, rate: float = 1000.0, seed: int = 0, still: str = "") -> RobotLog:
    """Make a log with exact motion, whose torques are Pinocchio's plus the law (3.5) with `TRUTH` in every joint."""
    generator = np.random.default_rng(seed)
    time = np.arange(round(duration * rate)) / rate
    joints = len(robot.joint_names)
    position, velocity, acceleration = np.zeros((3, len(time), joints))
    for k, name in enumerate(robot.joint_names):
        for omega in 2 * np.pi * generator.uniform(0.3, 1.6, 4):
            size, phase = (name != still) * generator.uniform(0.3, 0.6) / omega, generator.uniform(0, 6.28)
            position[:, k] += size * np.sin(omega * time + phase)
            velocity[:, k] += size * omega * np.cos(omega * time + phase)
            acceleration[:, k] -= size * omega**2 * np.sin(omega * time + phase)
    model, data = robot.tree.model, robot.tree.model.createData()
    needed = np.array([pin.rnea(model, data, *row) for row in zip(position, velocity, acceleration, strict=True)])
    law = get_law("stribeck")
    values = np.array([TRUTH[parameter.name] for parameter in law.parameters])
    friction = np.column_stack([law.torque(velocity[:, k], values) for k in range(joints)])
    return RobotLog(
        time=time,
        joint_names=robot.joint_names,
        position=position,
        velocity=velocity,
        acceleration=acceleration,
        torque=needed + friction,
    )


def save_npz(log: RobotLog, path: Path, **changed: object) -> Path:
    """Write a log's channels under their standard names; some are changed, or omitted if None."""
    arrays: dict[str, object] = {**log.channels(), "joint_names": np.array(log.joint_names), **changed}
    np.savez(path, **{name: array for name, array in arrays.items() if array is not None})
    return path
