"""Written logs are read unchanged, also by readers of the formats' own libraries."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.arm import arm_log, write_arm
from tests.cli.test_cli import refused, run
from tests.log.readers import formats
from tests.log.readers.formats import ROS, WHOLE, StubRobot, synthetic_log

from stribeck import Robot, RobotLog, read_log, write_log
from stribeck.io.writers import WRITERS

LOG = synthetic_log(60)
SHORT = RobotLog(time=LOG.time, joint_names=LOG.joint_names, position=LOG.position, torque=LOG.torque)


@pytest.mark.parametrize("suffix", WRITERS)
@pytest.mark.parametrize("log", [LOG, SHORT, replace(LOG, time=LOG.time + 1.7e9)], ids=["whole", "short", "since 1970"])
def test_a_log_is_read_as_it_was_written(tmp_path: Path, suffix: str, log: RobotLog) -> None:
    write_log(log, tmp_path / f"log{suffix}")
    again = read_log(tmp_path / f"log{suffix}", StubRobot() if log.foot_names else None)  # type: ignore[arg-type]
    for name, values in log.channels().items():
        found = getattr(again, name)
        start = log.time[0] if name == "time" and log.time[0] > 1e9 else 0.0
        np.testing.assert_allclose(found, values.astype(float) - start, atol=3e-7 if start else 1e-9, err_msg=name)
    assert again.joint_names == log.joint_names
    assert again.foot_names == log.foot_names


def test_the_command_applies_the_robot_file(tmp_path, capsys):
    """The robot file has torques in millinewton meters and other joint names."""
    robot_file = write_arm(tmp_path)
    log = arm_log(Robot.from_file(robot_file), duration=1.0)
    odd = {"q": log.position, "tau": 1e3 * log.torque}
    np.savez(tmp_path / "odd.npz", time=log.time, **odd)
    text = robot_file.read_text(encoding="utf-8")
    mapped = tmp_path / "mapped.toml"
    mapped.write_text(text + '\n[log.position]\nname = "q"\n[log.torque]\nname = "tau"\nunit = "mNm"\n', "utf-8")
    words = ("convert", tmp_path / "odd.npz", "-r", mapped, "-o", tmp_path / "plain.parquet")
    assert run(*words) == 0
    assert capsys.readouterr().out.splitlines()[-1] == str(tmp_path / "plain.parquet")
    plain = read_log(tmp_path / "plain.parquet")
    np.testing.assert_allclose(plain.torque, log.torque, rtol=1e-12)
    assert plain.joint_names == log.joint_names
    assert "already exists" in refused(capsys, *words)


@pytest.mark.parametrize("name", formats.WRITERS)
def test_every_channel_of_the_format_survives(name, tmp_path):
    log = synthetic_log(60)
    read = read_log(formats.WRITERS[name](tmp_path, log), StubRobot())
    assert (read.joint_names, read.foot_names) == (log.joint_names, log.foot_names)
    messages = {"acceleration", "temperature", "external_torque", "foot_force"}  # which have none of these
    assert log.channels().keys() - read.channels().keys() == (messages if name in ROS else set())
    assert name in ROS or read.notes == ()
    for channel, values in read.channels().items():
        np.testing.assert_allclose(values, log.channels()[channel], atol=1e-9 if name in ROS else 0.0, err_msg=channel)


@pytest.mark.parametrize("writer", formats.WRITERS.values(), ids=formats.WRITERS)
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
    monkeypatch.setattr("stribeck.core.log.storage.IN_MEMORY_LIMIT", 1000)
    log = synthetic_log()
    read = read_log(writer(tmp_path, log), StubRobot())
    base = read.position
    while isinstance(base.base, np.ndarray):
        base = base.base
    assert isinstance(base, np.memmap)
    np.testing.assert_array_equal(read.position, log.position)
    np.testing.assert_array_equal(read.foot_wrench, log.foot_wrench)
