"""The radius of ball feet shows in how they move while they stand."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.command_logs import trotting_quadruped

from stribeck import Robot
from stribeck.contact.rolling import with_rolling_feet
from stribeck.friction_torque.preparation import prepare


def test_the_radius_of_ball_feet_is_found_from_a_trot_with_raw_flags(tmp_path: Path) -> None:
    trotting_quadruped(tmp_path, seconds=8.0)
    robot = Robot.from_file(tmp_path / "robot.toml")
    ready = prepare(tmp_path / "log.npz", robot, robot.settings)
    rolling, notes = with_rolling_feet(robot, [(ready.log, ready.support.phases, ready.sampling.period)])
    assert notes
    assert [contact.radius for contact in rolling.contacts.values()] == pytest.approx([0.022] * 4, abs=0.006)
    assert np.all([contact.radius == 0 for contact in robot.contacts.values()])


def test_feet_that_slip_are_told_and_get_no_radius(tmp_path: Path) -> None:
    trotting_quadruped(tmp_path, seconds=8.0)
    robot = Robot.from_file(tmp_path / "robot.toml")
    ready = prepare(tmp_path / "log.npz", robot, robot.settings)
    turning = ready.log.base_orientation
    assert turning is not None
    spun = Rotation.from_rotvec(np.outer(1.0 * ready.log.time, [0.0, 0.0, 1.0])) * Rotation.from_quat(turning)
    log = replace(ready.log, base_orientation=spun.as_quat())  # as if the robot spun on its standing feet
    rolling, (note,) = with_rolling_feet(robot, [(log, ready.support.phases, ready.sampling.period)])
    assert "they slip" in note
    assert rolling is robot
