"""A long log of a 30-joint humanoid that steps from foot to foot, for measurements of speed, not of accuracy."""

import sysconfig
from pathlib import Path

import numpy as np
from tests.arm import sines, stribeck_torque

from stribeck.core.dynamics.root_motion import standing_root
from stribeck.core.dynamics.rooted import rooted_inverse_dynamics
from stribeck.core.dynamics.state import State
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot

FEET = ("left_foot", "right_foot")
STEP = 0.8
"""Duration of each foot's stance [s]."""
ROBOT_FILE = """
[robot]
model = "{model}"
position_controlled = ["head_1_joint", "head_2_joint"]
[robot.locked]
gripper_left_joint = 0.0
gripper_right_joint = 0.0
[contacts.left_foot]
frame = "left_sole_link"
[contacts.right_foot]
frame = "right_sole_link"
"""


def talos(folder: Path) -> Robot:
    """Read TALOS with 30 moving joints, and write its robot file to `folder`."""
    robots = Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix/share/example-robot-data/robots"
    path = folder / "robot.toml"
    path.write_text(ROBOT_FILE.format(model=robots / "talos_data/robots/talos_reduced.urdf"))
    return Robot.from_file(path)


def stepping_log(robot: Robot, samples: int, rate: float = 1000.0, seed: int = 0) -> RobotLog:
    """Make a log with torques from rooted inverse dynamics plus friction; steps have no double support."""
    generator = np.random.default_rng(seed)
    time = np.arange(samples) / rate
    position, velocity, acceleration = sines(generator, time, len(robot.joint_names), 1.5, (0.2, 0.5), 2)
    truth = {"viscous": 0.2, "coulomb": 1.0, "stribeck_gain": 0.2, "stribeck_velocity": 0.2, "offset": 0.5, "slope": 40}
    torque = stribeck_torque(velocity, truth)
    contact = np.zeros((samples, 2), dtype=bool)
    standing = (time // STEP).astype(int) % 2
    for k, foot in enumerate(FEET):
        rows = np.flatnonzero(standing == k)
        contact[rows, k] = True
        motion = position[rows], velocity[rows], acceleration[rows]
        root = standing_root(robot, foot, State(*motion))
        torque[rows] += rooted_inverse_dynamics(robot.rooted_at(foot), *motion, root)[1]
    return RobotLog(
        time=time,
        joint_names=robot.joint_names,
        position=position + 1e-5 * generator.normal(size=position.shape),
        torque=torque + 0.1 * generator.normal(size=torque.shape),
        foot_names=FEET,
        contact=contact,
    )
