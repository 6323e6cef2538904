"""A picture of a walk shows what happened: laws of rigid bodies, and feet that stay where they stand."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation
from tests.models import SIDES, STRIBECK, example_robot
from tests.report.conftest import TRUTH, build_result

from stribeck.base.typing import Array
from stribeck.errors import SettingsError
from stribeck.friction import Stribeck
from stribeck.log import RobotLog
from stribeck.robot import Robot
from stribeck.robot.kinematics import frame_pose
from stribeck_simulation.demo import truth_reference
from stribeck_simulation.pictures.walk import POSES, Pose, WalkPicture, stances, stick_figure, walk_picture
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


def test_links_are_rigid(picture):
    segments = np.array([pose.segments for pose in picture.poses])
    lengths = np.linalg.norm(segments[:, :, 1] - segments[:, :, 0], axis=-1)
    assert segments.shape == (POSES, len(picture.segment_names), 2, 3)
    assert np.ptp(lengths, axis=0).max() < 1e-12
    assert lengths.min() > 1e-3
    knee = picture.segment_names.index("left_knee")
    assert lengths[0, knee] == pytest.approx(0.38)


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


def test_the_orientation_may_be_that_of_another_frame(biped, walked, picture):
    log, base_position = walked
    other = replace(biped, base_frame="left_sole_link")
    turn, _ = frame_pose(biped.tree, biped.tree.model.getFrameId("left_sole_link"), log.position)
    orientation = (Rotation.from_quat(log.base_orientation) * Rotation.from_matrix(turn)).as_quat()
    seen = walk_picture(other, replace(log, base_orientation=orientation), base_position, SOLES)
    np.testing.assert_allclose(seen.com, picture.com, atol=1e-12)
    for one, same in zip(seen.poses, picture.poses, strict=True):
        np.testing.assert_allclose(one.segments, same.segments, atol=1e-12)


def test_the_poses_are_one_stride(picture):
    """From a touchdown of a foot to its next one."""
    first, last = picture.poses[0].time, picture.poses[-1].time
    feet = {one.time: one.foot for one in picture.footprints}
    assert feet[first] == feet[last]
    between = [one.foot for one in picture.footprints if first < one.time < last]
    assert [*between, feet[first]] in (["left_foot", "right_foot"], ["right_foot", "left_foot"])


def test_a_robot_that_stands_is_shown_all_the_time(biped):
    log, truth = exact_log(biped, Stribeck(), KNEES, duration=2.0, rate=200.0, gait="stand", posture=POSTURES["biped"])
    standing = walk_picture(biped, log, truth.base_position, SOLES)
    assert [one.foot for one in standing.footprints] == ["left_foot", "right_foot"]
    np.testing.assert_allclose(
        [pose.time for pose in standing.poses], np.linspace(*log.time[[0, -1]], POSES), atol=3e-3
    )


def test_a_touch_is_no_stance_and_a_bounce_no_swing():
    time = 0.01 * np.arange(100)
    contact = np.zeros((100, 2), dtype=bool)
    contact[:40, 0] = contact[60:, 0] = contact[30:70, 1] = True
    contact[[45, 46, 90], [0, 0, 1]] = True
    assert stances(time, contact) == [(0, 39, 0), (30, 69, 1), (60, 99, 0)]
    contact[[20, 21, 80, 50], [0, 0, 0, 1]] = False
    assert stances(time, contact) == [(0, 39, 0), (30, 69, 1), (60, 99, 0)]
    assert stances(time, np.zeros_like(contact)) == []


def test_point_feet_are_points():
    go2 = example_robot("go2")
    data = go2.tree.model.createData()
    pin.framesForwardKinematics(go2.tree.model, data, pin.neutral(go2.tree.model))
    lines = [line for name, line in stick_figure(go2, data, {}) if name in go2.contacts]
    assert len(lines) == 8  # there and back again
    for contact in go2.contacts.values():
        foot = data.oMf[go2.tree.model.getFrameId(contact.frame)].translation
        assert np.linalg.norm(np.array(lines).reshape(-1, 3) - foot, axis=1).min() < 1e-12


def test_an_arm_does_not_walk(walked):
    log, base_position = walked
    with pytest.raises(SettingsError, match="floating base"):
        walk_picture(example_robot("panda"), log, base_position, {})
    with pytest.raises(SettingsError, match="contact"):
        walk_picture(Robot.from_file(MODELS / "robot.toml"), replace(log, contact=None), base_position, {})


def test_truth_beside_the_result_is_the_law():
    result = build_result()
    law, joints = Stribeck(), {"left_hip_yaw": TRUTH, "not_in_the_result": TRUTH}
    shown = truth_reference(result, law, joints)
    assert list(shown.curves) == ["left_hip_yaw"]
    velocity, torque = shown.curves["left_hip_yaw"]
    assert (velocity[0], velocity[-1]) == result.joints["left_hip_yaw"].velocity_range
    np.testing.assert_array_equal(torque, law.torque(velocity, np.array([TRUTH[p.name] for p in law.parameters])))
    assert np.diff(velocity).max() < 0.02 * np.ptp(velocity)
    assert shown.parameters == joints
    assert truth_reference(replace(result, law="coulomb-viscous"), law, joints).parameters == {}
