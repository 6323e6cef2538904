"""Law averaged like the acceleration: reversals no longer distort it."""

from pathlib import Path

import numpy as np

from stribeck import Robot, Settings, identify
from stribeck.core.log import RobotLog
from stribeck.core.settings import FilterSettings

INERTIA, PERIOD, STEPS = 0.2, 1e-3, 20
TRUTH = np.array([0.2, 1.0, 0.2, 0.2, 0.5, 40.0])
SAVGOL = FilterSettings(kind="savitzky-golay", window=51)


def wheel(folder: Path) -> Robot:
    """Wheel on a vertical axis without gravity torque."""
    (folder / "wheel.urdf").write_text(
        '<robot name="wheel"><link name="base"/><link name="rim"><inertial><mass value="1"/>'
        f'<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="{INERTIA}"/></inertial></link>'
        '<joint name="axle" type="continuous"><parent link="base"/><child link="rim"/><axis xyz="0 0 1"/></joint>'
        "</robot>"
    )
    (folder / "robot.toml").write_text('[robot]\nmodel = "wheel.urdf"\nbase = "fixed"\n')
    return Robot.from_file(folder / "robot.toml")


def wheel_log() -> RobotLog:
    """Log of the wheel under a smooth torque: friction and acceleration jump when it reverses."""
    seconds = 24.0
    step = PERIOD / STEPS
    time = np.arange(0.0, seconds, step)
    pulses, sizes = 2 * np.pi * np.array([0.31, 0.67, 1.3]), np.array([1.2, 1.5, 1.1])
    torque = TRUTH[4] + np.sin(pulses * time[:, None] + [0.3, 1.1, 2.0]) @ sizes
    viscous, coulomb, gain, speed, offset, slope = TRUTH.tolist()
    positions, position, velocity = np.empty(len(time)), 0.0, 0.0
    for k, applied in enumerate(torque.tolist()):  # a differential equation
        positions[k] = position
        sliding = coulomb * np.tanh(slope * velocity) * (1 + gain * np.exp(-((velocity / speed) ** 2)))
        velocity += step * (applied - viscous * velocity - sliding - offset) / INERTIA
        position += step * velocity
    rows = slice(None, None, STEPS)
    return RobotLog(time=time[rows], joint_names=("axle",), position=positions[rows, None], torque=torque[rows, None])


def errors(robot: Robot, log: RobotLog, **changes: object) -> np.ndarray:
    """Compute the relative error of each parameter."""
    found = identify(log, robot, Settings(method="curve-fit", filter=SAVGOL, **changes)).joints["axle"].parameters
    return np.array([each.value for each in found.values()]) / TRUTH - 1


def test_reversals_bend_a_law_that_is_not_averaged_and_no_other(tmp_path: Path) -> None:
    robot, log = wheel(tmp_path), wheel_log()
    plain, averaged = errors(robot, log), errors(robot, log, averaged_law=True)
    gain_and_speed = [2, 3]
    assert np.abs(plain[gain_and_speed]).min() > 0.15
    np.testing.assert_allclose(averaged[gain_and_speed], 0, atol=0.04)
    np.testing.assert_allclose(averaged[[0, 1, 4, 5]], 0, atol=0.01)
