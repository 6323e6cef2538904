"""A payload that the robot holds for a part of a log is named, and accepted by pasting its table."""

import re
from pathlib import Path

import pytest
from tests.arm import TRUTH, arm_log, save_npz, write_arm
from tests.cli.test_cli import run
from tests.whole_log.test_pilot import carrying

from stribeck import Robot, read_result
from stribeck_simulation.sensors.measure import with_noise


@pytest.mark.long
def test_a_payload_is_named_and_its_spans_are_used_when_it_is_accepted(tmp_path: Path) -> None:
    robot = Robot.from_file(write_arm(tmp_path))
    log = save_npz(
        with_noise(carrying(robot, arm_log(robot)), position=2e-5, torque=0.05, seed=3), tmp_path / "log.npz"
    )
    command = ["identify", str(log), "-r", str(tmp_path / "robot.toml"), "-o"]
    assert run(*command, str(tmp_path / "before")) == 0
    findings = {each.check: each for each in read_result(tmp_path / "before/result.json").findings}
    assert "set-aside" not in findings
    assert findings["payload"].text.startswith("The robot carries something: 3 kg at ")
    start, end = map(float, re.findall(r"from ([\d.]+) to ([\d.]+) s", findings["payload"].text)[0])
    assert (start, end) == (pytest.approx(6.0, abs=0.3), pytest.approx(14.0, abs=0.3))
    line = re.findall(r"payload = \[.*\](?= in \[robot\])", findings["payload"].cure)[0]
    assert [float(x) for x in re.findall(r"com = \[(.*?)\]", line)[0].split(",")] == pytest.approx(
        [0.05, 0, 0.1], abs=0.01
    )
    write_arm(tmp_path, f"{line}\n")
    assert run(*command, str(tmp_path / "after")) == 0
    result = read_result(tmp_path / "after/result.json")
    assert {each.check for each in result.findings} == set()
    for joint in result.joints.values():
        coulomb = joint.parameters["coulomb"]
        assert coulomb.value == pytest.approx(TRUTH["coulomb"], rel=0.02)
        assert coulomb.value == pytest.approx(TRUTH["coulomb"], abs=3 * coulomb.standard_error)
