"""The demonstration's files are what a user would have: a log of sensors, a robot file, and the truth apart."""

from __future__ import annotations

import json

import numpy as np
import pytest

from stribeck.friction import Stribeck
from stribeck.readers import read_log
from stribeck.robot import Robot
from stribeck.simulation.demo import ENCODER_NOISE, TORQUE_NOISE, demo_parameters, demo_posture, make_demo
from stribeck.simulation.exact import exact_log


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo")
    return make_demo(folder, duration=3.0, seed=5)


def test_its_log_is_read_without_settings_and_is_noisy_as_said(made):
    robot = Robot.from_file(made.robot_file)
    log = read_log(made.log, robot)
    assert log.joint_names == robot.joint_names
    assert log.foot_names == ("left_foot", "right_foot")
    assert log.velocity is None
    assert log.acceleration is None
    assert set(log.contact.sum(axis=1)) == {1, 2}
    exact, truth = exact_log(robot, Stribeck(), demo_parameters(), duration=3.0, seed=5, posture=demo_posture())
    assert np.std(log.position - exact.position) == pytest.approx(ENCODER_NOISE, rel=0.02)
    assert np.std(log.torque - exact.torque) == pytest.approx(TORQUE_NOISE, rel=0.02)
    np.testing.assert_array_equal(log.base_orientation, exact.base_orientation)
    np.testing.assert_array_equal(log.foot_wrench, exact.foot_wrench)
    assert truth.friction_torque.any()


def test_truth_lies_beside_the_log(made):
    truth = json.loads((made.log.parent / "truth.json").read_text())
    assert truth == {"law": "stribeck", "joints": made.parameters}
    robot = Robot.from_file(made.robot_file)
    assert set(made.parameters) == set(robot.joint_names) - set(robot.position_controlled)
    assert made.parameters["left_knee"]["coulomb"] == 1.0
    assert made.parameters["right_hip_yaw"]["offset"] == 0.75
    assert sorted(path.name for path in made.log.parent.iterdir()) == [
        "biped.urdf",
        "log.npz",
        "robot.toml",
        "truth.json",
    ]
