"""`stribeck export` as a user types it: the model that was found, or one sentence and no file."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.arm import URDF, needed_torque, write_arm
from tests.cli.test_cli import refused, run
from tests.exporters.found import FRICTION, found_in, joint_result, robot_of
from tests.exporters.test_models import assert_same_dynamics, read_again
from tests.whole_log.logs import TRUTH

from stribeck import Robot, export
from stribeck.core.friction import get_law
from stribeck.io.writers import write_log
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.sensors.measure import with_noise


def test_a_wrong_model_comes_out_nearer_to_the_truth(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    true, _ = robot_of("arm", tmp_path)
    export(found_in(true)[0], true, tmp_path / "wrong.urdf", "urdf", inertia=True)
    wrong = read_again(true, tmp_path / "wrong.urdf")
    exact, _ = exact_log(true, get_law("stribeck"), dict.fromkeys(true.joint_names, TRUTH), duration=20.0, seed=1)
    write_log(with_noise(exact, position=1e-5, torque=0.05, seed=4), tmp_path / "log.npz")
    out = tmp_path / "out"
    assert run("identify", tmp_path / "log.npz", "-r", wrong.path, "-o", out, "--method", "whole-log") == 0
    capsys.readouterr()
    arguments = ("export", out, "--format", "urdf", "-o", out / "new.urdf", "--overwrite")  # of the result's robot
    assert run(*arguments, "--inertia", "keep") == 0
    assert "Kept the model's inertias" in capsys.readouterr().out
    assert_same_dynamics(wrong, read_again(true, out / "new.urdf"), 1e-15)
    assert "--with mass: expected inertia" in refused(capsys, *arguments, "--with", "mass")
    assert run(*arguments, "--with", "inertia") == 0  # an older name
    written = (out / "new.urdf").read_text()
    assert run(*arguments) == 0
    assert (out / "new.urdf").read_text() == written
    printed = capsys.readouterr().out
    assert "Wrote the estimated inertias" in printed
    assert printed.endswith(f"{out / 'new.urdf'}\n")
    new = read_again(true, out / "new.urdf")

    def torque(robot: Robot) -> np.ndarray:
        return needed_torque(robot, exact.position[::50], exact.velocity[::50], exact.acceleration[::50])

    off = [np.sqrt(np.mean((torque(robot) - torque(true)) ** 2)) for robot in (wrong, new)]
    assert off[1] < 0.1 * off[0]


def test_a_result_or_target_that_does_not_fit_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result, _ = found_in(Robot.from_file(write_arm(tmp_path)))
    elbow = result.corrections.bodies["elbow"]
    heavy = replace(result.corrections, bodies={"elbow": replace(elbow, mass=(2 * elbow.mass[0], elbow.mass[1]))})
    unknown = replace(result.corrections, bodies={"knee": elbow})
    knee = replace(result, joints={"knee": joint_result(FRICTION)})
    (tmp_path / "there").mkdir()
    for found, target, name, words in [
        (result, "unity", "new.urdf", ["'unity'", "expected mjcf, urdf"]),
        (result, "urdf", "arm.urdf", ["arm.urdf: is read, and is not written over"]),
        (result, "urdf", "there", ["there"]),  # a folder
        (knee, "urdf", "new.urdf", ["robot.toml", "'knee'", "shoulder, elbow, slide"]),
        (replace(result, corrections=heavy), "urdf", "new.urdf", ["arm.urdf", "'elbow'", "2 kg instead of 4 kg"]),
        (replace(result, corrections=unknown), "urdf", "new.urdf", ["arm.urdf", "joint 'knee', which is missing"]),
    ]:
        (tmp_path / "result.json").write_text(found.to_json())
        arguments = ("export", tmp_path, "-r", tmp_path / "robot.toml", "--to", target, "-o", tmp_path / name)
        sentence = refused(capsys, *arguments)
        assert all(word in sentence for word in words), sentence
        assert sorted(os.listdir(tmp_path)) == ["arm.urdf", "result.json", "robot.toml", "there"]
        assert (tmp_path / "arm.urdf").read_text() == URDF
