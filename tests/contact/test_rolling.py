"""The radius of ball feet shows in how they move while they stand."""

from pathlib import Path

import numpy as np
import pytest
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
