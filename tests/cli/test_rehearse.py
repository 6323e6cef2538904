"""`stribeck rehearse`: what the identification of a known friction finds with a log's motion, rate and noise."""

import re
from dataclasses import replace

import numpy as np
import pytest
from tests.arm import arm_log, save_npz, write_arm
from tests.cli.test_cli import refused, run
from tests.exporters.found import robot_of

from stribeck import Robot, read_result
from stribeck.core.friction import get_law
from stribeck.io.writers import write_log
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.sensors.measure import with_noise


def test_a_rehearsal_distinguishes_noisy_and_resting_joints(tmp_path, capsys):
    """The same motion and noise as in the log: the elbow rests, and the slide's torque is too noisy."""
    robot = Robot.from_file(write_arm(tmp_path))
    log = arm_log(robot, duration=15, rate=250, still="elbow")
    noise = np.random.default_rng(0).standard_normal(log.torque.shape) * [0.1, 0.1, 30.0]
    save_npz(replace(log, torque=log.torque + noise), tmp_path / "log.npz")
    arguments = ("rehearse", robot.path, tmp_path / "log.npz", "-o", tmp_path / "out")
    assert run(*arguments) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("1 of 3 joints would be identified within ± ")
    assert re.search(r"motion of the log, 1[45]\.\d s at 250 Hz; friction and torque noise", printed)
    found = read_result(tmp_path / "out/result.json").joints
    verdicts = {name: own.verdict for name, own in found.items()}
    assert verdicts == {"shoulder": "identified", "elbow": "not excited", "slide": "weak"}
    again = np.load(tmp_path / "out/log.npz")
    white = 1.4826 * np.median(np.abs(np.diff(again["torque"], 6, axis=0)), axis=0) / np.sqrt(924)
    assert 0.5 < white[0] / 0.1 < 2  # it explains the interval, which also contains errors of the model
    assert 0.5 < white[2] / 30 < 2
    assert found["shoulder"].friction([1.0])[0] == pytest.approx(1.5, rel=0.1)  # that of the log, which is 1.5
    assert "already exists" in refused(capsys, *arguments)


@pytest.mark.long
def test_a_walking_robot_rehearses_a_walk_of_the_same_length(tmp_path, capsys):
    robot, _ = robot_of("quadruped", tmp_path)
    friction = {name: {"viscous": 0.3, "coulomb": 0.8, "offset": 0.0} for name in robot.joint_names}
    log, _ = exact_log(robot, get_law("coulomb-viscous"), friction, duration=8.0, rate=250.0)
    write_log(with_noise(log, position=1e-5, torque=0.1), tmp_path / "log.npz")
    assert run("rehearse", robot.path, tmp_path / "log.npz", "-o", tmp_path / "out") == 0
    printed = capsys.readouterr().out
    assert printed.startswith("12 of 12 joints would be identified within ± ")
    assert "random walk, " in printed
    found = read_result(tmp_path / "out/result.json")
    assert found.log.duration == pytest.approx(8.0, abs=0.5)
    for joint in found.joints.values():
        assert joint.friction([0.5])[0] == pytest.approx(0.95, rel=0.2)
