"""A picture of a walk shows what happened: laws of rigid bodies, and feet that stay where they stand."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from tests.models import SIDES, STRIBECK, example_robot

from stribeck.base.typing import Array
from stribeck.errors import SettingsError
from stribeck.friction import Stribeck
from stribeck.log import RobotLog
from stribeck.robot import Robot
from stribeck_simulation.pictures.walk import Pose, WalkPicture, stances, walk_picture
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.robots import MODELS
from stribeck_simulation.robots.sole import Sole
from stribeck_simulation.run import POSTURES

SOLES = {f"{side}_foot": Sole((0.03, 0.0, 0.01), 0.11, 0.05) for side in SIDES}
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


def exchanged(name: str) -> str:
    return name.replace("left", "#").replace("right", "left").replace("#", "right")


def by_name(picture: WalkPicture, pose: Pose) -> dict[str, np.ndarray]:
    """Lines of each name; a foot has three."""
    names = np.array(picture.segment_names)
    return {name: pose.segments[names == name] for name in picture.segment_names}


def mirror(biped: Robot, log: RobotLog, base_position: np.ndarray) -> tuple[RobotLog, np.ndarray]:
    """The same motion as a mirror in the plane y = 0 shows it."""
    names = biped.joint_names
    place = [names.index(exchanged(name)) for name in names]
    sign = np.array([1.0 if any(word in name for word in ("pitch", "knee", "elbow")) else -1.0 for name in names])
    mirrored = replace(
        log,
        position=sign * log.position[:, place],
        base_orientation=log.base_orientation * [-1, 1, -1, 1],
        contact=log.contact[:, ::-1],
    )
    return mirrored, base_position * [1, -1, 1]


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


def test_a_mirrored_walk_is_a_mirrored_picture(biped, walked, picture):
    mirrored = walk_picture(biped, *mirror(biped, *walked), SOLES)
    lines = {pose.time: by_name(picture, pose) for pose in picture.poses}
    shared = [pose for pose in mirrored.poses if pose.time in lines]
    assert len(shared) > 3
    for image in shared:
        reflected = by_name(mirrored, image)
        for name, original in lines[image.time].items():
            np.testing.assert_allclose(reflected[exchanged(name)], original * [1, -1, 1], atol=1e-12)
    np.testing.assert_allclose(mirrored.com, picture.com * [1, -1], atol=1e-12)


def test_a_touch_is_no_stance_and_a_bounce_no_swing():
    time = 0.01 * np.arange(100)
    contact = np.zeros((100, 2), dtype=bool)
    contact[:40, 0] = contact[60:, 0] = contact[30:70, 1] = True
    contact[[45, 46, 90], [0, 0, 1]] = True
    assert stances(time, contact) == [(0, 39, 0), (30, 69, 1), (60, 99, 0)]
    contact[[20, 21, 80, 50], [0, 0, 0, 1]] = False
    assert stances(time, contact) == [(0, 39, 0), (30, 69, 1), (60, 99, 0)]
    assert stances(time, np.zeros_like(contact)) == []


def test_an_arm_does_not_walk(walked):
    log, base_position = walked
    with pytest.raises(SettingsError, match="floating base"):
        walk_picture(example_robot("panda"), log, base_position, {})
    with pytest.raises(SettingsError, match="contact"):
        walk_picture(Robot.from_file(MODELS / "robot.toml"), replace(log, contact=None), base_position, {})
