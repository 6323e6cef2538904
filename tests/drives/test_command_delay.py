"""Logs of position commands match their ground truth, and the delay of late commands is found."""

from pathlib import Path

import numpy as np
import pytest
from tests.command_logs import clamped_quadruped, hobby_arm, lerobot_arm

from stribeck import Result, Robot, identify, read_log
from stribeck.check.drives.command_delay import pooled
from stribeck.check.drives.torques import with_found_delays
from stribeck.check.init.answers import draft_robot_file
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.log.interpolation import delayed


@pytest.mark.parametrize(("write", "log"), [(hobby_arm, "log.npz"), (lerobot_arm, "dataset")], ids=["npz", "LeRobot"])
def test_a_robot_file_for_commands_asks_only_for_the_gains(write, log, tmp_path: Path) -> None:
    drives = write(tmp_path, seconds=20.0)
    model = str(Robot.from_file(tmp_path / "robot.toml").model_path)
    draft = draft_robot_file(model, tmp_path / log, tmp_path / "new.toml")
    assert "gain of each drive" in draft.questions[0]
    assert len(draft.questions) == 1 + ("is this the unit?" in draft.questions[-1]) == 1 + (write is lerobot_arm)
    gains = ", ".join(f"{name} = {own.kp}" for name, own in drives.items())
    source = 'torque_source = "command"'
    (tmp_path / "new.toml").write_text(draft.text.replace(source, f"{source}\nkp = {{ {gains} }}"))
    read, wanted = (read_log(tmp_path / log, Robot.from_file(tmp_path / name)) for name in ("new.toml", "robot.toml"))
    np.testing.assert_allclose(read.command, wanted.command, rtol=0.05, atol=0.2 if write is hobby_arm else 1e-9)


def covered(found: Result, drives: dict, name: str) -> list[bool]:
    """Tell which points of a joint's curve have the ground truth in their interval, and are within 10 %."""
    own = drives[name]
    points = [(p, own.coulomb * np.sign(p.velocity) + own.viscous * p.velocity) for p in found.joints[name].curve]
    return [p.interval_95[0] <= truth <= p.interval_95[1] or abs(p.value / truth - 1) < 0.1 for p, truth in points]


@pytest.mark.parametrize(
    ("write", "log", "delay", "options"),
    [
        pytest.param(hobby_arm, "log.npz", 0.022, {"latency": 0.012, "seconds": 24.0}, marks=pytest.mark.long),
        pytest.param(hobby_arm, "log.npz", 0.070, {"latency": 0.060, "seed": 2}, marks=pytest.mark.long),
        (lerobot_arm, "dataset", 0.0217, {"latency": 0.005, "seconds": 24.0}),
        (clamped_quadruped, "log.npz", 0.007, {"rate": 500.0, "seconds": 8.0}),  # thinned, while commands are held
    ],
    ids=["arm", "late arm", "dataset", "quadruped"],
)
def test_the_delay_of_commands_is_not_taken_for_viscous_friction(write, log, delay, options, tmp_path: Path) -> None:
    drives = write(tmp_path, **options)
    found = identify(tmp_path / log, tmp_path / "robot.toml")
    for value, error in found.corrections.command_delay.values():
        assert value == pytest.approx(delay, abs=2.5 * error)
        assert error < 0.1 * delay
    assert not {"several-causes", "rotor-missing", "friction-delay"} & {finding.check for finding in found.findings}
    identified = [name for name in drives if found.joints[name].verdict == "identified"]
    assert len(identified) >= 0.8 * len(drives)
    if write is lerobot_arm:  # kd is not given: viscous friction includes it
        assert any(finding.check == "drive-damping" for finding in found.findings)
    else:
        assert all(all(covered(found, drives, name)) for name in identified)


def test_drives_share_one_delay_unless_their_estimates_differ() -> None:
    error = np.full(8, 4e-4)
    same = np.array([8.2, 7.8, 8.4, 7.9, 8.1, 7.6, 8.3, 8.0]) / 1e3
    for found, wanted, most in (
        (same, np.full(8, 8e-3), 3.5e-4),
        (np.append(same[:7], -5e-3), np.full(8, 8e-3), 3.5e-4),  # only a wrong model makes a delay negative
        (np.append(same[:4], same[4:] + 6e-3), 8e-3 + np.repeat([0, 6e-3], 4), 7e-4),  # two networks
    ):
        delay, spread = pooled(found, error)[1]
        assert np.all(np.abs(delay - wanted) < 2 * spread)
        assert np.all(spread < most)
    delay, spread = pooled(np.append(same[:7], 14e-3), error)[1]
    assert delay[-1] - 2 * spread[-1] < 8e-3 < 14e-3 < delay[-1] + 2 * spread[-1]


def test_a_log_that_no_fit_sees_gets_the_delay_of_the_others(tmp_path: Path) -> None:
    logs = []
    for name, latency in (("seen", 0.012), ("unseen", 0.040)):
        (tmp_path / name).mkdir()
        hobby_arm(tmp_path / name, seconds=20.0, latency=latency)
        robot = Robot.from_file(tmp_path / name / "robot.toml")
        logs.append(prepare(tmp_path / name / "log.npz", robot, robot.settings))
    (seen, unseen), _ = with_found_delays(logs[:1], robot, robot.settings, logs[1:])
    assert seen.log.command_delays == unseen.log.command_delays
    assert np.mean(seen.log.command_delays, axis=0)[0] == pytest.approx(0.022, abs=2e-3)


def test_late_commands_are_those_from_before() -> None:
    time = 0.01 * np.arange(50)
    found = delayed(np.stack([time, time], axis=1), time, np.array([0.1, 0.0]))
    np.testing.assert_allclose(found[10:], np.stack([time - 0.1, time], axis=1)[10:], atol=1e-12)
