"""Spans of a log that are excluded, and the findings that name them."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.arm import arm_log, save_npz, write_arm
from tests.cli.test_cli import run
from tests.mujoco_arm import record, with_force, write_case

from stribeck import LogError, Robot, RobotLog, read_result
from stribeck.core.base.spans import Span
from stribeck.simulation.sensors.measure import with_noise


@pytest.fixture(scope="module")
def pushed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with an arm and its log, in which a hand turns all joints from 6 to 9 s."""
    folder = Path(tmp_path_factory.mktemp("arm"))
    robot = Robot.from_file(write_arm(folder))
    log = arm_log(robot, duration=20.0, rate=250.0)
    hand = 8 * np.sin(3 * log.time)[:, None] * ((log.time > 6) & (log.time < 9))[:, None] * np.ones(3)
    save_npz(with_noise(replace(log, torque=log.torque + hand), position=2e-5, torque=0.05, seed=3), folder / "log.npz")
    return folder


def identify(folder: Path, output: str, *options: str) -> int:
    files = ["identify", str(folder / "log.npz"), "-r", str(folder / "robot.toml"), "-o", str(folder / output)]
    return run(*files, *options)


def test_a_disturbance_is_named_in_time_and_its_remedy_can_be_pasted(pushed: Path) -> None:
    assert identify(pushed, "first") == 0
    (found,) = (each for each in read_result(pushed / "first/result.json").findings if each.check == "set-aside")
    options = re.findall(r"--exclude \S+", found.remedy)
    start, end = map(float, re.findall(r"[\d.]+", options[0]))
    assert (len(options), start, end) == (1, pytest.approx(6.0, abs=0.3), pytest.approx(9.0, abs=0.3))
    assert f"from {start:g} to {end:g} s" in found.text
    assert "set aside" in (pushed / "first/report.html").read_text()
    assert identify(pushed, "second", *options[0].split()) == 0
    result = read_result(pushed / "second/result.json")
    assert "set-aside" not in {each.check for each in result.findings}
    assert result.log.samples < 4_500
    assert "excluded" in (pushed / "second/report.html").read_text()


@pytest.mark.long
def test_a_table_that_is_touched_does_not_refuse_the_log_or_hide_wrong_units(tmp_path: Path) -> None:
    log = record([1.5, 2.0, 2.5], 30.0)
    for start in (4.0, 12.0, 21.0):
        with_force(log, (start, start + 3.0), [20.0, 6.0, 45.0])
    write_case(tmp_path, log)
    for output, method, identified in (("whole", "whole-log", 3), ("fitted", "curve-fit", 0)):
        assert identify(tmp_path, output, "--method", method) == 0
        result = read_result(tmp_path / output / "result.json")
        (found,) = (each for each in result.findings if each.check == "set-aside")
        spans = sorted(tuple(map(float, each)) for each in re.findall(r"--exclude ([\d.]+):([\d.]+)", found.remedy))
        np.testing.assert_allclose(spans, [(4, 7), (12, 15), (21, 24)], atol=0.4)
        assert sum(joint.verdict == "identified" for joint in result.joints.values()) >= identified
        if identified:  # on held-out parts that nothing touches
            assert min(joint.torque_r2.nominal for joint in result.joints.values()) > 0.95
    write_case(tmp_path, log | {"torque": 1e3 * log["torque"]})
    assert identify(tmp_path, "wrong") == 2


@pytest.mark.parametrize("corrections", ["auto", pytest.param("none", marks=pytest.mark.long)])
def test_the_link_that_is_pushed_is_named_with_the_force(corrections: str, tmp_path: Path) -> None:
    log = record([1.5, 2.0, 2.5], 24.0)
    with_force(log, (3.0, 7.0), [20.0, 6.0, 45.0])
    with_force(log, (10.0, 13.0), [-10.0, 20.0, 10.0], link=2)
    high = (log["time"] > 16) & (log["time"] < 21)
    log["torque"][high, 0] = log["torque"][high, 0].clip(-4, 4)
    write_case(tmp_path, log, f'[identify]\ncorrections = "{corrections}"\n')
    assert identify(tmp_path, "out") == 0
    (text,) = (each.text for each in read_result(tmp_path / "out/result.json").findings if each.check == "set-aside")
    assert re.search(r"2\.\d to 7\.\d s \(a force of about (49|50) N on link 3\)", text)
    assert re.search(r"9\.\d to 13\.\d s \(a force of about (24|25) N on link 2\)", text)
    assert re.search(r"(15|16)[.\d]* to [.\d]+ s \(the torque of shoulder 1 is clipped\)", text)


def test_a_push_of_the_only_joint_is_named(tmp_path: Path) -> None:
    log = record([1.5, 0.0, 0.0], 16.0)
    log["torque"][(log["time"] > 6) & (log["time"] < 9), 0] += 20.0
    first = {name: log[name][:, :1] for name in ("position", "torque")}
    write_case(tmp_path, first | {"time": log["time"], "joint_names": np.array(["shoulder 1"])})
    with (tmp_path / "robot.toml").open("a") as file:
        file.write('\n[robot.locked]\n"elbow 2" = 0.0\n"wrist 3" = 0.0\n')
    assert identify(tmp_path, "out") == 0
    (text,) = (each.text for each in read_result(tmp_path / "out/result.json").findings if each.check == "set-aside")
    assert "only the torque of shoulder 1 disagrees" in text


@pytest.mark.parametrize(
    "name", ["log.npz", "log", "./log.npz", "{folder}/log.npz", "{folder}/../{folder.name}/log.npz"]
)
def test_a_log_is_named_by_its_path_or_file_name(pushed, name, capsys, monkeypatch):
    monkeypatch.chdir(pushed)
    for path in ("log.npz", str(pushed / "log.npz")):
        assert run("inspect", path, "-r", "robot.toml", "--exclude", f"{name.format(folder=pushed)}:6:9") == 0
        assert "6 to 9 s of the log is excluded." in capsys.readouterr().out


def test_excluding_counts_from_the_start_of_the_whole_log() -> None:
    time = 100.0 + np.arange(50) / 10
    log = RobotLog(time=time, joint_names=("elbow",), position=time[:, None], torque=time[:, None])
    part = log.between(1.0, 4.0).excluding([Span(2.0, 3.0), Span(8.0, 9.0)])
    np.testing.assert_array_equal(part.time, time[[*range(10, 20), *range(30, 41)]])
    notes = ("2 to 3 s of the log is excluded.", "8 to 9 s of the log is excluded, but has no samples.")
    assert part.notes[1:] == notes
    with pytest.raises(LogError, match="fewer than 2 samples remain after excluding 0 to 9 s"):
        log.excluding([Span(0.0, 9.0)])
