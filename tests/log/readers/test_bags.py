"""Incomplete bags, and bags with inconsistent messages, are refused or read correctly."""

import struct
from pathlib import Path

import numpy as np
import pytest
from rosbags import rosbag2
from rosbags.typesys import Stores, get_typestore
from tests.damaged import main_file
from tests.log.readers.formats import (
    StubRobot,
    messages_of,
    synthetic_log,
    write_messages,
    write_rosbag2,
    write_rosbag2_of_mcap,
)

from stribeck.errors import LogError
from stribeck.log.readers import read_log

STORE = get_typestore(Stores.ROS2_HUMBLE)
LOG = synthetic_log(60)


def states(log, change):
    """Make messages of a log; `change(k, message)` changes the k-th joint state, or returns another topic for it."""
    rows = 0
    for topic, kind, stamp, message in messages_of(log, STORE):
        if topic == "/joint_states":
            topic = change(rows, message) or topic
            rows += 1
        yield topic, kind, stamp, message


def reorder(message, places):
    message.name = [message.name[place] for place in places]
    for channel in ("position", "velocity", "effort"):
        setattr(message, channel, getattr(message, channel)[places])


def test_joints_whose_order_changes_are_matched_by_name(tmp_path):
    def permuted(row, message):
        if row % 3 == 0:
            reorder(message, [2, 0, 1])

    read = read_log(write_messages(tmp_path / "log.mcap", states(LOG, permuted)), StubRobot())
    np.testing.assert_allclose(read.time, LOG.time, atol=1e-9)
    np.testing.assert_allclose(read.position, LOG.position, atol=1e-12)
    np.testing.assert_allclose(read.torque, LOG.torque, atol=1e-12)


def test_a_slow_imu_is_ignored(tmp_path):
    sent = [m for row, m in enumerate(messages_of(synthetic_log(301), STORE)) if m[0] != "/imu" or row // 6 % 100 == 0]
    read = read_log(write_messages(tmp_path / "log.mcap", sent), StubRobot())
    assert len(read.time) == 301
    assert read.base_orientation is None
    assert any("'/imu' is ignored: 5 Hz" in note for note in read.notes)


def flip(path: Path, value: float) -> None:
    """Change one digit of a number in a file."""
    content = bytearray(path.read_bytes())
    content[content.index(struct.pack("<d", value)) + 6] ^= 0x10
    path.write_bytes(content)


@pytest.mark.parametrize("inside", [False, True], ids=["alone", "in a rosbag2"])
@pytest.mark.parametrize("chunked", [True, False], ids=["in chunks", "not in chunks"])
def test_an_mcap_with_another_number_than_was_written(inside, chunked, tmp_path):
    path = folder = write_rosbag2_of_mcap(tmp_path, LOG)
    file = write_messages(main_file(path), messages_of(LOG, STORE), chunked=chunked)
    if not inside:
        path = file.rename(tmp_path / "log.mcap")
    np.testing.assert_allclose(read_log(path, StubRobot()).position, LOG.position, atol=1e-12)
    flip(path if path.is_file() else main_file(folder), LOG.position[30, 1])
    with pytest.raises(LogError, match=r"(?i)crc|checksum"):
        read_log(path, StubRobot())


PLUGINS = pytest.mark.parametrize("plugin", rosbag2.StoragePlugin)


@PLUGINS
@pytest.mark.parametrize("mode", [rosbag2.CompressionMode.FILE, rosbag2.CompressionMode.MESSAGE])
def test_a_compressed_bag_is_read(plugin, mode, tmp_path):
    path = write_rosbag2(tmp_path, LOG, plugin, mode)
    np.testing.assert_allclose(read_log(path, StubRobot()).position, LOG.position, atol=1e-12)


@pytest.mark.parametrize("lost", [1, 100, 2000, 4096])
def test_a_database_cut_in_its_last_page(lost, tmp_path):
    path = write_rosbag2(tmp_path, synthetic_log(190))
    file = main_file(path)
    size = file.stat().st_size
    file.write_bytes(file.read_bytes()[:-lost])
    with pytest.raises(LogError, match=f"db3 ends after {size - lost} of {size} bytes|disk image is malformed"):
        read_log(path, StubRobot())


def test_a_bag_that_was_not_closed(tmp_path):
    path = write_rosbag2(tmp_path, LOG)
    main_file(path).with_name(main_file(path).name + "-wal").write_bytes(b"messages")
    with pytest.raises(LogError, match=r"db3-wal: contains messages that were not merged"):
        read_log(path, StubRobot())
