"""Validation logs, and parts of logs."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.arm import TRUTH, arm_log, save_npz, stribeck_torque, write_arm
from tests.cli.test_cli import run

from stribeck import Robot, SettingsError, identify, read_result
from stribeck.core.log.interpolation import linear


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


def test_a_result_predicts_and_scores_a_log(desk: dict[str, Any], tmp_path: Path) -> None:
    """As a regressor does: with the file of its robot, and in samples of the log; `scores` shows another friction."""
    file, (_, unseen) = write_arm(tmp_path), desk["logs"]
    identify(desk["paths"][0], file, method="curve-fit").save(tmp_path / "result.json")
    result = read_result(tmp_path)
    predicted = result.predict(unseen)
    off = np.abs(predicted - stribeck_torque(unseen.velocity, TRUTH | {"offset": 0.0}))
    assert np.isfinite(off).mean() > 0.98
    assert np.nanmax(off) < 0.1
    offsets = [joint.values["offset"] for joint in result.values()]
    np.testing.assert_allclose(result.predict(unseen, offset=True), predicted + offsets)
    stiffer = replace(unseen, torque=unseen.torque + [0.0, 2.0, 0.0] * np.sign(np.gradient(unseen.position, axis=0)))
    same, other = result.scores(desk["paths"][1]), result.scores(stiffer)
    assert result.score(unseen) == pytest.approx(np.mean([*same.values()])) == pytest.approx(1.0, abs=0.01)
    assert other["shoulder"] == pytest.approx(same["shoulder"], abs=0.001)
    assert other["elbow"] < 0.8
    file.write_text(file.read_text() + "# changed")
    with pytest.raises(SettingsError, match=r"result.json: has the robot file .*robot.toml, which has changed since"):
        result.score(unseen)


def test_the_command_prints_writes_and_draws_it(desk, tmp_path, capsys):
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
        (["--validate", "nowhere.npz"], "nowhere.npz: no such file; check the path"),
        (["--from", "5", "--to", "2"], "--from is 5 s and --to is 2 s; expected 0 <= --from < --to"),
        (["--from", "-1"], "--from is -1 s and --to is inf s; expected 0 <="),
        (["--from", "nan"], "--from is nan s"),
        (["--from", "30"], "the start of the part, 30 s, is after the end of the log (6 s)"),
        (["--from", "soon"], "valid number"),
    ],
)
def test_what_cannot_be_used_ends_with_exit_code_2(options, words, desk, tmp_path, capsys):
    log = str(desk["paths"][0])
    command = ["identify", log, "--robot", str(desk["file"]), "-o", str(tmp_path / "o")]
    assert run(*command, *(option.format(log=log) for option in options)) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "o").exists()
