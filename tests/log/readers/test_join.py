"""Topics with different rates are resampled to the clock of the joint states."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.log.readers.formats import JOINTS, StubRobot, synthetic_log
from tests.log.readers.messages import START, messages_of, write_messages

from stribeck.core.errors import LogError
from stribeck.core.log import RobotLog
from stribeck.core.settings import LogTable
from stribeck.io.readers import read_log


def messages(log: RobotLog, prefix: str = "", **keep):
    """Make messages of a log with thinned topics: `imu=3` keeps every third message of `/imu`."""
    counts: dict[str, int] = {}
    for topic, kind, stamp, message in messages_of(log):
        word = next((word for word in keep if word in topic), "")
        counts[topic] = counts.get(topic, -1) + 1
        if counts[topic] % keep.get(word, 1) == 0:
            yield prefix + topic, kind, stamp, message


def read(folder: Path, sent, robot=None, **table) -> RobotLog:
    robot = robot or StubRobot()
    robot.log_table = LogTable.model_validate(table)
    return read_log(write_messages(folder / "log.mcap", sorted(sent, key=lambda message: message[2])), robot)


def test_slower_streams_are_interpolated_and_flags_are_held(tmp_path):
    log = synthetic_log(101)
    wrench = log.time[:, None, None] * np.arange(1.0, 13).reshape(1, 2, 6)
    log = RobotLog(**{**vars(log), "foot_wrench": wrench})
    result = read(tmp_path, messages(log, imu=5, sensors=10, contacts=10))
    np.testing.assert_allclose(result.position, log.position, atol=1e-12)
    np.testing.assert_allclose(result.base_orientation, log.base_orientation, atol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(result.base_orientation, axis=1), 1)
    np.testing.assert_allclose(result.foot_wrench, wrench, atol=1e-9)
    np.testing.assert_array_equal(result.contact, log.contact[np.arange(101) // 10 * 10])
    assert any("'/imu' is resampled from 100 Hz (interpolated)" in note for note in result.notes)
    assert any("the last value is held" in note for note in result.notes)


def test_only_the_time_that_all_wanted_topics_cover_is_kept(tmp_path):
    log = synthetic_log(100)
    late = [m for m in messages(log) if m[0] != "/imu" or 10 <= (m[2] - START) / 2e6 <= 89]
    result = read(tmp_path, late)
    np.testing.assert_allclose(result.position, log.position[10:90], atol=1e-12)
    assert any("20 messages outside" in note for note in result.notes)


def test_a_pause_of_a_topic_is_not_bridged(tmp_path):
    log = synthetic_log(100)
    paused = [m for m in messages(log) if m[0] != "/imu" or not 40 <= (m[2] - START) / 2e6 <= 60]
    result = read(tmp_path, paused)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(result.base_orientation[:, 0])), np.arange(40, 61))
    assert np.isfinite(result.position).all()


def test_joints_of_two_topics_make_one_robot(tmp_path):
    log = synthetic_log(60)
    arm = RobotLog(time=log.time, joint_names=("arm",), position=log.position[:, :1] * 2, torque=log.torque[:, :1] * 2,
                   velocity=log.velocity[:, :1] * 2)  # fmt: skip
    second = [("/arm/joint_states", *m[1:]) for m in messages(arm)]
    second = second[::2] + second[-1:]
    result = read(tmp_path, [*messages(log), *second], StubRobot(joint_names=("arm", *JOINTS)))
    np.testing.assert_allclose(result.position[:, 1:], log.position, atol=1e-12)
    np.testing.assert_allclose(result.position[:, 0], arm.position[:, 0], atol=1e-4)


def test_joints_of_the_same_names_get_the_namespaces_of_their_topics(tmp_path):
    log = synthetic_log(60)
    sent = [m for m in messages(log) if m[0] == "/joint_states"]
    spaces = {"left": "/cell/left/joint_states", "right": "/cell/right/joint_states"}
    both = [(topic, *m[1:]) for topic in spaces.values() for m in sent]
    both += [("/cell/left/controller/states", *m[1:]) for m in sent]  # not the usual topic, and left out
    names = {f"{space}/{joint}": f"{space}_{joint}" for space in spaces for joint in JOINTS}
    result = read(tmp_path, both, StubRobot(joint_names=tuple(names.values())), joint_names=names)
    np.testing.assert_allclose(result.position, np.tile(log.position, 2), atol=1e-12)
    with pytest.raises(LogError, match=f'set joint_names = {{ "(left|right)/{JOINTS[0]}" = "{JOINTS[0]}"'):
        read(tmp_path, both)
    arm, of_arm = tuple(names.values())[: len(JOINTS)], dict(list(names.items())[: len(JOINTS)])
    part = read(tmp_path, both[: len(sent)], StubRobot(joint_names=arm), joint_names=of_arm)  # one arm was recorded
    np.testing.assert_allclose(part.position, log.position, atol=1e-12)
    left = read(tmp_path, both, position={"name": spaces["left"]})  # only one arm, with its own names
    np.testing.assert_allclose(left.torque, log.torque, atol=1e-12)
    with pytest.raises(LogError, match="'/joint_states', '/left/joint_states' all contain"):  # a repeated topic
        read(tmp_path, [*sent, *(("/left/joint_states", *m[1:]) for m in sent)])


def test_settings_choose_between_topics(tmp_path):
    log = synthetic_log(40)
    commands = RobotLog(**{**vars(log), "torque": log.torque + 1})
    both = [*messages(log, "/measured"), *messages(commands, "/asked")]
    with pytest.raises(LogError, match="all contain base_orientation"):
        read(tmp_path, both)
    chosen = {
        "position": {"name": "/measured/joint_states"},
        "torque": {"name": "/asked/joint_states"},
        "base_orientation": {"name": "/measured/imu"},
        "foot_wrench": {"name": ["/measured/sensors/left_foot_ft", "/measured/sensors/right_foot_ft"]},
        "contact": {"name": ["/measured/contacts/left_foot", "/measured/contacts/right_foot"]},
    }
    result = read(tmp_path, both, **chosen)
    np.testing.assert_allclose(result.position, log.position, atol=1e-12)
    np.testing.assert_allclose(result.torque, log.torque + 1, atol=1e-12)
    with pytest.raises(LogError, match=r"\[log.torque\] name lists topic '/x'; topics .* are '/measured/joint_states'"):
        read(tmp_path, both, position={"name": "/measured/joint_states"}, torque={"name": "/x"})


def test_an_imu_that_does_not_measure_orientation_gives_none(tmp_path):
    log = synthetic_log(40)
    sent = [m for m in messages(log) if m[0] in ("/joint_states", "/imu")]
    for message in sent:
        if message[0] == "/imu":
            message[3].orientation_covariance[0] = -1
    result = read(tmp_path, sent)
    assert result.base_orientation is None
    np.testing.assert_allclose(result.angular_velocity, log.angular_velocity, atol=1e-12)


def test_the_effort_of_another_topic_is_an_external_torque(tmp_path):
    log = synthetic_log(60)
    motor = [("/load", *m[1:]) for m in messages(replace(log, torque=log.external_torque)) if m[0] == "/joint_states"]
    result = read(tmp_path, [*messages(log), *motor], external_torque={"name": "/load", "scale": -2.0})
    np.testing.assert_allclose(result.torque, log.torque, atol=1e-12)
    np.testing.assert_allclose(result.external_torque, -2 * log.external_torque, atol=1e-12)
    with pytest.raises(LogError, match=r"\[log\.external_torque\] name lists topic '/imu'; topics .* are '/joint_st"):
        read(tmp_path, messages(log), external_torque={"name": "/imu"})
