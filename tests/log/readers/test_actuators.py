"""Torques that are logged before the gear, in amperes, or as a command."""

from dataclasses import replace

import numpy as np
import pytest
from tests.arm import arm_log, save_npz, stribeck_torque, write_arm
from tests.log.readers.formats import synthetic_log
from tests.log.readers.messages import messages_of, write_messages

from stribeck import Robot, inspect_log, read_log, write_log
from stribeck.core.errors import LogError, RobotFileError
from stribeck.core.settings import FilterSettings, Settings

JOINTS = ("shoulder", "elbow", "slide")
CONSTANT, RATIO = np.array([0.1, 0.05, 2.0]), np.array([50.0, 100.0, 20.0])
KP, KD = np.array([80.0, 60.0, 200.0]), np.array([2.0, 1.0, 5.0])
COMMANDED = 'torque_source = "command"\nkp = { shoulder = 80.0, elbow = 60.0, slide = 200.0 }\n'
GAINS = COMMANDED + "kd = { shoulder = 2.0, elbow = 1.0, slide = 5.0 }\n"
EXACT = Settings(method="curve-fit", filter=FilterSettings(kind="log"), fit_armature=False)


def motors(constant=True):
    lines = [
        f"[robot.motors.{joint}]\nratio = {ratio}" + f"\ntorque_constant = {k}" * constant
        for joint, k, ratio in zip(JOINTS, CONSTANT, RATIO, strict=True)
    ]
    return "\n".join(lines) + "\n"


def robot(folder, text):
    return Robot.from_file(write_arm(folder, text))


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return arm_log(robot(tmp_path_factory.mktemp("arm"), ""), duration=12.0, rate=500.0)


def test_currents_become_torques_of_the_joints(log, tmp_path):
    arm = robot(tmp_path, 'torque_source = "motor_current"\n' + motors() + '[log.torque]\nname = "i"\nunit = "mA"\n')
    path = save_npz(log, tmp_path / "log.npz", torque=None, i=1e3 * log.torque / (CONSTANT * RATIO))
    found = read_log(path, arm)
    np.testing.assert_allclose(found.torque, log.torque, rtol=1e-12)
    assert found.unscaled == {}


def test_torques_before_the_gear_become_torques_of_the_joints(log, tmp_path):
    arm = robot(tmp_path, 'torque_source = "motor_side_sensor"\n' + motors(constant=False))
    found = read_log(save_npz(log, tmp_path / "log.npz", torque=log.torque / RATIO), arm)
    np.testing.assert_allclose(found.torque, log.torque, rtol=1e-12)
    assert found.torque_source == "motor_side_sensor"


def commanded(log, velocity=True):
    """Make the channels of a log whose drives use kp, kd and a feedforward torque."""
    forward = 0.3 * log.torque
    desired_velocity = log.velocity + 0.01 * np.cos(7 * log.time)[:, None]
    rest = log.torque - forward - KD * ((desired_velocity if velocity else 0.0) - log.velocity)
    found = {"desired_position": log.position + rest / KP, "desired_torque": forward, "torque": None}
    return found | ({"desired_velocity": desired_velocity} if velocity else {})


@pytest.mark.parametrize("velocity", [True, False])
def test_commands_become_torques(velocity, log, tmp_path):
    found = read_log(save_npz(log, tmp_path / "log.npz", **commanded(log, velocity)), robot(tmp_path, GAINS))
    np.testing.assert_allclose(found.torque, log.torque, atol=1e-10)
    term = "kd (desired_velocity - velocity)" if velocity else "- kd velocity"
    assert any("Torques are computed from the command" in note and term in note for note in found.notes)


def test_the_delay_of_a_command_is_found_and_taken_out(log, tmp_path):
    log = replace(log, torque=log.torque - 0.9 * stribeck_torque(log.velocity))  # so that each joint's delay shows
    shift = 4  # the command acts 8 ms after it was logged: the motion is late against it
    sent = {"desired_torque": log.torque, "desired_position": log.position, "desired_velocity": log.velocity}
    sent = {name: np.roll(values, -shift, axis=0) for name, values in sent.items()}
    path = save_npz(log, tmp_path / "log.npz", **sent, torque=None)
    found = inspect_log(path, robot(tmp_path, GAINS), EXACT)
    assert all(abs(joint.delay) < 1e-3 for joint in found.joints.values() if joint.delay)
    (finding,) = [each for each in found.audit if each.check == "command-delay"]
    assert "command_delay = 0.00" in finding.cure
    (setting,) = finding.settings
    assert setting.value == pytest.approx(8e-3, abs=1e-3)
    corrected = read_log(path, robot(tmp_path, GAINS + "command_delay = 0.008\n"))
    inner = slice(shift, -shift)
    np.testing.assert_allclose(corrected.torque[inner], log.torque[inner], atol=1e-6)
    assert not inspect_log(path, robot(tmp_path, GAINS + "command_delay = 0.008\n")).audit


def test_a_topic_of_commands_is_held_until_the_next(tmp_path):
    log = synthetic_log()
    messages = []
    for number, message in enumerate(m for m in messages_of(log) if m[0][1] == "j"):
        messages.append(message)
        if number % 20 == 0:
            target = messages_of(log.take(slice(number, number + 1)))
            messages.append(("/command", *next(iter(target))[1:]))
    path = write_messages(tmp_path / "log.mcap", messages)
    text = 'torque_source = "command"\nkp = 10.0\nkd = 0.0\n[log.desired_position]\nname = "/command"\n'
    text += "[log.joint_names]\nhip = 'shoulder'\nknee = 'elbow'\nwheel = 'slide'\n"
    found = read_log(path, robot(tmp_path, text))
    rows = np.arange(len(found.time))
    wanted = 10 * (log.position[rows - rows % 20] - log.position[rows]) + log.torque[rows - rows % 20]
    np.testing.assert_allclose(found.torque, wanted, atol=1e-9)
    assert any("'/command' is resampled" in note for note in found.notes)


REFUSED = {
    "kd alone": ('torque_source = "command"\nkd = 1.0\n', "kp has no value for joint 'shoulder'"),
    "kp of a sensor": ("kp = 1.0\nkd = 1.0\n", "for torque_source 'command'"),
    "motor behind the gear": ("[robot.motors.elbow]\nratio = 2.0\n", "'motor_current' or 'motor_side_sensor'"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_invalid_robot_files(case, tmp_path):
    text, words = REFUSED[case]
    with pytest.raises(RobotFileError, match=rf"^{tmp_path}.*{words}"):
        robot(tmp_path, text)


def test_logs_without_the_command(log, tmp_path):
    arm = robot(tmp_path, GAINS)
    whole = commanded(log)
    with pytest.raises(LogError, match="the log has none; expected an array 'desired_position'"):
        read_log(save_npz(log, tmp_path / "a.npz", **whole | {"desired_position": None}), arm)
    found = read_log(save_npz(log, tmp_path / "b.npz", **whole, velocity=None), arm)
    assert any("differentiated velocity" in note for note in found.notes)
    path = save_npz(log, tmp_path / "c.npz", **whole)
    with pytest.raises(LogError, match="kp has no value for joint 'shoulder'; the log's desired torques require it"):
        read_log(path, robot(tmp_path, 'torque_source = "command"\n'))
    with pytest.raises(LogError, match=r"or \[robot\] torque_source = 'command' to use its desired positions"):
        read_log(path, robot(tmp_path, ""))
    found = read_log(save_npz(log, tmp_path / "d.npz", **whole | {"desired_torque": None}), robot(tmp_path, COMMANDED))
    assert found.unscaled == {}
    late = robot(tmp_path, 'torque_source = "command"\ncommand_delay = 0.01\n')
    assert any("command_delay is ignored" in note for note in read_log(save_npz(log, tmp_path / "e.npz"), late).notes)
    some = robot(tmp_path, 'torque_source = "command"\nkp = { elbow = 60.0 }\n')
    found = read_log(tmp_path / "d.npz", some)
    assert found.unscaled == {"shoulder": 1.0, "slide": 1.0}
    np.testing.assert_allclose(found.torque[:, 0], (whole["desired_position"] - log.position)[:, 0], atol=1e-12)


def test_currents_are_not_written_as_torques(log, tmp_path):
    arm = robot(tmp_path, 'torque_source = "motor_current"\n[log.torque]\nunit = "A"\n')
    found = read_log(save_npz(log, tmp_path / "log.npz"), arm)
    assert tuple(found.unscaled) == JOINTS
    with pytest.raises(LogError, match="are in amperes"):
        write_log(found, tmp_path / "out.npz")
    assert not (tmp_path / "out.npz").exists()
