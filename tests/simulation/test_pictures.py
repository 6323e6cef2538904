"""Poses of a walk: feet stay on the ground, and short contacts are no steps."""

import numpy as np
import pinocchio as pin
import pytest
from tests.models import SIDES, STRIBECK

from stribeck.core.friction import Stribeck
from stribeck.core.robot import Robot
from stribeck.simulation.pictures.walk import stances, walk_poses
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.robots import MODELS
from stribeck.simulation.run import POSTURES


def test_a_foot_is_on_the_ground_in_every_pose_of_a_stride():
    biped, friction = Robot.from_file(MODELS / "robot.toml"), {f"{side}_knee": STRIBECK for side in SIDES}
    log, truth = exact_log(biped, Stribeck(), friction, duration=7.0, rate=200.0, posture=POSTURES["biped"])
    poses = walk_poses(biped, log, truth.base_position)
    model, data = biped.tree.model, biped.tree.model.createData()
    heights = []
    for pose in poses:
        pin.framesForwardKinematics(model, data, pose.configuration)
        feet = [data.oMf[model.getFrameId(contact.frame)].translation[2] for contact in biped.contacts.values()]
        heights.append(min(feet))
    assert np.all(np.diff([pose.time for pose in poses]) > 0)
    assert heights == pytest.approx([heights[0]] * 8, abs=1e-3)  # [m]; a swinging foot can be lower


def test_a_touch_is_no_stance_and_a_bounce_no_swing():
    time = 0.01 * np.arange(100)
    contact = np.zeros((100, 2), dtype=bool)
    contact[:40, 0] = contact[60:, 0] = contact[30:70, 1] = True
    contact[[45, 46, 90], [0, 0, 1]] = True
    assert stances(time, contact) == [(0, 39, 0), (30, 69, 1), (60, 99, 0)]
    contact[[20, 21, 80, 50], [0, 0, 0, 1]] = False
    assert stances(time, contact) == [(0, 39, 0), (30, 69, 1), (60, 99, 0)]
    assert stances(time, np.zeros_like(contact)) == []
