"""A log that is written and read again is unchanged, in every format."""

import numpy as np
import pytest
from tests.log.readers.formats import ROS, WHOLE, WRITERS, StubRobot, synthetic_log

from stribeck.log.readers import read_log

OF_MESSAGES = (
    "position",
    "velocity",
    "torque",
    "base_orientation",
    "angular_velocity",
    "linear_acceleration",
    "contact",
    "foot_wrench",
)


@pytest.mark.parametrize("writer", WHOLE.values(), ids=WHOLE)
def test_every_channel_survives(writer, tmp_path):
    log = synthetic_log()
    read = read_log(writer(tmp_path, log), StubRobot())
    assert read.joint_names == log.joint_names
    assert read.foot_names == log.foot_names
    assert read.notes == ()
    assert read.channels().keys() == log.channels().keys()
    for name, channel in log.channels().items():
        np.testing.assert_array_equal(read.channels()[name], channel, err_msg=name)


@pytest.mark.parametrize("writer", ROS.values(), ids=ROS)
def test_messages_survive(writer, tmp_path):
    log = synthetic_log(60)
    read = read_log(writer(tmp_path, log), StubRobot())
    assert read.foot_names == log.foot_names
    np.testing.assert_allclose(read.time - read.time[0], log.time, atol=1e-9)
    for name in OF_MESSAGES:
        np.testing.assert_allclose(getattr(read, name), getattr(log, name), atol=1e-12, err_msg=name)
    assert read.acceleration is None
    assert read.temperature is None
    assert read.external_torque is None


@pytest.mark.parametrize("writer", WRITERS.values(), ids=WRITERS)
def test_the_robot_gives_the_order_and_the_rest_is_ignored_by_name(writer, tmp_path):
    log = synthetic_log(60)
    read = read_log(writer(tmp_path, log), StubRobot(joint_names=("wheel", "hip"), contacts={"right_foot": None}))
    assert read.joint_names == ("wheel", "hip")
    assert read.foot_names == ("right_foot",)
    np.testing.assert_allclose(read.position, log.position[:, [2, 0]], atol=1e-12)
    np.testing.assert_allclose(read.torque, log.torque[:, [2, 0]], atol=1e-12)
    np.testing.assert_allclose(read.foot_wrench[:, 0], log.foot_wrench[:, 1], atol=1e-12)
    assert any("'knee'" in note for note in read.notes)


@pytest.mark.parametrize("writer", WHOLE.values(), ids=WHOLE)
def test_channels_beyond_the_memory_limit_lie_on_disk_and_read_the_same(writer, tmp_path, monkeypatch):
    monkeypatch.setattr("stribeck.log.storage.IN_MEMORY_LIMIT", 1000)
    log = synthetic_log()
    read = read_log(writer(tmp_path, log), StubRobot())
    base = read.position
    while isinstance(base.base, np.ndarray):
        base = base.base
    assert isinstance(base, np.memmap)
    np.testing.assert_array_equal(read.position, log.position)
    np.testing.assert_array_equal(read.foot_wrench, log.foot_wrench)
