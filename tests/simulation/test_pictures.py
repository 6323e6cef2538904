"""A picture of a walk shows what happened: laws of rigid bodies, and feet that stay where they stand."""

import numpy as np
import pinocchio as pin
import pytest
from tests.models import SIDES, STRIBECK

from stribeck.core.base.typing import Array
from stribeck.core.friction import Stribeck
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.simulation.pictures.walk import stances, walk_picture
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.robots import MODELS
from stribeck.simulation.robots.sole import Sole
from stribeck.simulation.run import POSTURES

SOLES = {f"{side}_foot": Sole(centre=[0.03, 0.0, 0.01], half_length=0.11, half_width=0.05) for side in SIDES}
"""Soles of the packaged biped, ahead of their frames."""
KNEES = {f"{side}_knee": STRIBECK for side in SIDES}
"""Where there is friction, which no picture shows."""
Walked = tuple[RobotLog, Array]


@pytest.fixture(scope="module")
def biped() -> Robot:
    return Robot.from_file(MODELS / "robot.toml")


@pytest.fixture(scope="module")
def walked(biped) -> Walked:
    """Six steps of the packaged biped, and where its base was."""
    log, truth = exact_log(biped, Stribeck(), KNEES, duration=7.0, rate=200.0, posture=POSTURES["biped"])
    return log, truth.base_position


@pytest.fixture(scope="module")
def picture(biped, walked: Walked):
    return walk_picture(biped, *walked, SOLES)


def test_footprints_lie_where_the_feet_stand(biped, walked, picture):
    """Pinocchio's own kinematics of the whole robot puts the standing foot's frame onto its print, at any time."""
    log, base_position = walked
    model = biped.tree.model
    data = model.createData()
    assert [one.foot for one in picture.footprints[:2]] == ["left_foot", "right_foot"]
    assert len(picture.footprints) == 8  # two at the start, six steps
    for one in picture.footprints:
        row = int(np.searchsorted(log.time, one.time)) + 3
        assert log.contact[row, log.foot_names.index(one.foot)]
        q = np.concatenate([base_position[row], log.base_orientation[row], log.position[row, biped.tree.columns]])
        pin.framesForwardKinematics(model, data, q)
        pose = data.oMf[model.getFrameId(biped.contacts[one.foot].frame)]
        np.testing.assert_allclose(one.place, pose.act(np.array([0.03, 0.0, 0.01]))[:2], atol=1e-9)
        assert pin.rpy.matrixToRpy(pose.rotation)[2] == pytest.approx(one.yaw, abs=1e-9)
        assert one.size == pytest.approx((0.22, 0.10))


def test_a_touch_is_no_stance_and_a_bounce_no_swing():
    time = 0.01 * np.arange(100)
    contact = np.zeros((100, 2), dtype=bool)
    contact[:40, 0] = contact[60:, 0] = contact[30:70, 1] = True
    contact[[45, 46, 90], [0, 0, 1]] = True
    assert stances(time, contact) == [(0, 39, 0), (30, 69, 1), (60, 99, 0)]
    contact[[20, 21, 80, 50], [0, 0, 0, 1]] = False
    assert stances(time, contact) == [(0, 39, 0), (30, 69, 1), (60, 99, 0)]
    assert stances(time, np.zeros_like(contact)) == []
