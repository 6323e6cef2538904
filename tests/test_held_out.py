"""Validation logs, and parts of logs."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.arm import arm_log, save_npz, write_arm
from tests.cli.test_cli import run

from stribeck import LogError, Robot, RobotLog, SettingsError, identify, read_result
from stribeck.log.interpolation import linear


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Make a robot file, the arm, and two logs of it with different motions."""
    folder = tmp_path_factory.mktemp("desk")
    file = write_arm(folder)
    robot = Robot.from_file(file)
    logs = [arm_log(robot, duration=6, rate=250, seed=seed) for seed in (0, 1)]
    paths = [save_npz(log, folder / f"log_{k}.npz") for k, log in enumerate(logs)]
    return {"file": file, "robot": robot, "logs": logs, "paths": paths}


@pytest.mark.parametrize("method", ["curve-fit", "observer", "direct"])
def test_every_method_explains_a_log_that_it_has_not_seen(method: str, desk: dict[str, Any]) -> None:
    log, unseen = desk["logs"]
    (found,) = identify(log, desk["robot"], method=method, validate=[unseen]).held_out
    assert list(found.joints) == list(desk["robot"].joint_names)
    assert found.duration == pytest.approx(5.996)
    for error in found.joints.values():
        assert error.rms < 0.1 * error.rms_zero_friction
        assert error.torque_r2 > 0.99
        assert error.samples > 1000


def test_errors_of_sensors_that_were_found_are_taken_out(desk: dict[str, Any]) -> None:
    late = [replace(log, torque=linear(log.time - 0.006, log.time, log.torque)) for log in desk["logs"]]
    (corrected,) = identify(late[0], desk["robot"], law="stribeck", validate=late[1:]).held_out
    (uncorrected,) = identify(late[0], desk["robot"], method="curve-fit", validate=late[1:]).held_out
    for name, error in corrected.joints.items():
        assert error.rms < 0.5 * uncorrected.joints[name].rms


def test_another_friction_shows(desk: dict[str, Any]) -> None:
    log, unseen = desk["logs"]
    stiffer = replace(unseen, torque=unseen.torque + [0.0, 2.0, 0.0] * np.sign(np.gradient(unseen.position, axis=0)))
    same, other = identify(log, desk["robot"], method="curve-fit", validate=[unseen, stiffer.between(0.5)]).held_out
    assert other.joints["elbow"].rms == pytest.approx(2.0, abs=0.2)
    assert other.joints["shoulder"].rms == pytest.approx(same.joints["shoulder"].rms, abs=0.02)


def test_the_command_prints_writes_and_draws_it(
    desk: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, unseen = desk["paths"]
    command = ["identify", str(log), "--validate", str(unseen), "--robot", str(desk["file"]), "-o", str(tmp_path / "o")]
    assert run(*command, "--method", "curve-fit", "--from", "0.2") == 0
    assert f"{unseen}, 5.996 s:" in capsys.readouterr().out
    result = read_result(tmp_path / "o/result.json")
    assert result.log.duration == pytest.approx(5.796, abs=0.005)
    (found,) = result.held_out
    assert (found.path, len(found.sha256), list(found.joints)) == (str(unseen), 64, ["shoulder", "elbow", "slide"])
    page = (tmp_path / "o/report.html").read_text()
    assert "Validation logs" in page
    assert f"{found.joints['elbow'].rms:.3g}" in page


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--validate", "{log}"], "100 % of its samples are also in"),
        (["--validate", "nowhere.npz"], "nowhere.npz: no such file; expected a log"),
        (["--from", "5", "--to", "2"], "--from is 5 s and --to is 2 s; expected 0 <= --from < --to"),
        (["--from", "-1"], "--from is -1 s and --to is inf s; expected 0 <="),
        (["--from", "nan"], "--from is nan s"),
        (["--from", "30"], "the start of the part, 30 s, is after the end of the log (6 s)"),
        (["--from", "soon"], "valid number"),
    ],
)
def test_what_cannot_be_used_ends_with_exit_code_2(
    options: list[str], words: str, desk: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = str(desk["paths"][0])
    command = ["identify", log, "--robot", str(desk["file"]), "-o", str(tmp_path / "o")]
    assert run(*command, *(option.format(log=log) for option in options)) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "o").exists()


def test_a_log_of_another_robot_is_refused(desk: dict[str, Any]) -> None:
    other = replace(desk["logs"][1], joint_names=("hip", "knee", "slide"), path="other.npz")
    with pytest.raises((LogError, SettingsError), match=r"other\.npz"):
        identify(desk["logs"][0], desk["robot"], method="curve-fit", validate=[other.take(slice(0, 10))])


def test_between_cuts_out_a_part() -> None:
    time = 100.0 + np.arange(50) / 10
    log = RobotLog(time=time, joint_names=("elbow",), position=time[:, None], torque=time[:, None])
    np.testing.assert_array_equal(log.between(1.0, 2.0).time, time[10:21])
    np.testing.assert_array_equal(log.between(stop=1.0).time, time[:11])
    np.testing.assert_array_equal(log.between(start=4.0).position[:, 0], time[40:])
    assert log.between(1.0, 2.0).notes == ("Only 1 s to 2 s of the log's 4.9 s are used.",)
    with pytest.raises(LogError, match=r"log: the part from 4\.9 s to 9 s has fewer than 2 samples"):
        log.between(4.9, 9.0)
