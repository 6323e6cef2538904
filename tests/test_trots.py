"""Trots with raw contact flags or none are identified without settings, and ball feet get their radius."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from studies.coverage import points_of
from tests.command_logs import trotting_quadruped

from stribeck import Robot, identify
from stribeck.core.dynamics.contact.rolling import with_rolling_feet
from stribeck.core.equations.friction_torque.preparation import prepare


@pytest.mark.parametrize(
    "log",
    [{"rate": 200.0}, {"carries": 1.7}, pytest.param({"flags": False}, marks=pytest.mark.long)],
    ids=["raw flags at 200 Hz", "a payload that the model lacks", "no flags"],
)
def test_a_trot_is_identified_and_covered_by_default(log, tmp_path):
    carries = log.pop("carries", 0.0)
    drives = trotting_quadruped(tmp_path, keys=(), seconds=15.0, ramps=True, **log)
    path = tmp_path / "robot.toml"
    path.write_text(path.read_text().replace('"command"', '"motor_current"'))
    model = Robot.from_file(path).model_file
    heavy = model.read_text()
    assert 'mass="6.921"' in heavy
    model.write_text(heavy.replace('mass="6.921"', f'mass="{6.921 - carries}"'))
    result = identify(tmp_path / "log.npz", path)
    assert sum(joint.verdict == "identified" for joint in result.joints.values()) >= 10
    points = points_of(result, drives, lambda name, speed: drives[name].coulomb + drives[name].viscous * speed)
    assert all(covered or error < 0.15 for _, covered, error in points)
    assert sum(covered for _, covered, _ in points) >= 29


def test_ball_feet_get_their_radius_from_a_trot_with_raw_flags_unless_they_slip(tmp_path: Path) -> None:
    trotting_quadruped(tmp_path, seconds=8.0)
    model = tmp_path / "quadruped.xml"
    model.write_text(model.read_text().replace('size="0.022"', 'type="box" size="0.02 0.02 0.022"'))
    robot = Robot.from_file(tmp_path / "robot.toml")
    ready = prepare(tmp_path / "log.npz", robot, robot.settings)
    rolling, notes = with_rolling_feet(robot, [(ready.log, ready.support.phases, ready.sampling.period)])
    assert notes
    assert [contact.radius for contact in rolling.contacts.values()] == pytest.approx([0.022] * 4, abs=0.006)
    assert np.all([contact.radius == 0 for contact in robot.contacts.values()])
    spin = Rotation.from_rotvec(np.outer(ready.log.time, [0.0, 0.0, 1.0]))  # as if it spun on its standing feet
    log = replace(ready.log, base_orientation=(spin * Rotation.from_quat(ready.log.base_orientation)).as_quat())
    slipping, (note,) = with_rolling_feet(robot, [(log, ready.support.phases, ready.sampling.period)])
    assert "they slip" in note
    assert slipping is robot
