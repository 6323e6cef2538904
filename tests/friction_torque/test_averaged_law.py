"""Law averaged like the acceleration: reversals no longer distort it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import stribeck.friction_torque.inverse_dynamics
from stribeck import Robot, Settings, identify
from stribeck.errors import SettingsError
from stribeck.friction import get_law
from stribeck.log import RobotLog
from stribeck.settings import FilterSettings

INERTIA, PERIOD, STEPS = 0.2, 1e-3, 20
TRUTH = np.array([0.2, 1.0, 0.2, 0.2, 0.5, 40.0])
LAW = get_law("stribeck")
SAVGOL = FilterSettings(kind="savitzky-golay", window=51)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """Wheel on a vertical axis without gravity torque."""
    folder: Path = tmp_path_factory.mktemp("wheel")
    (folder / "wheel.urdf").write_text(
        '<robot name="wheel"><link name="base"/><link name="rim"><inertial><mass value="1"/>'
        f'<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="{INERTIA}"/></inertial></link>'
        '<joint name="axle" type="continuous"><parent link="base"/><child link="rim"/><axis xyz="0 0 1"/></joint>'
        "</robot>"
    )
    (folder / "robot.toml").write_text('[robot]\nmodel = "wheel.urdf"\nbase = "fixed"\n')
    return Robot.from_file(folder / "robot.toml")


@pytest.fixture(scope="module")
def log() -> RobotLog:
    """Log of the wheel under a smooth torque: friction and acceleration jump when it reverses."""
    seconds = 24.0
    step = PERIOD / STEPS
    time = np.arange(0.0, seconds, step)
    pulses, sizes = 2 * np.pi * np.array([0.31, 0.67, 1.3]), np.array([1.2, 1.5, 1.1])
    torque = TRUTH[4] + np.sin(pulses * time[:, None] + [0.3, 1.1, 2.0]) @ sizes
    viscous, coulomb, gain, speed, offset, slope = TRUTH.tolist()
    positions, position, velocity = np.empty(len(time)), 0.0, 0.0
    for k, applied in enumerate(torque.tolist()):  # a differential equation
        positions[k] = position
        sliding = coulomb * np.tanh(slope * velocity) * (1 + gain * np.exp(-((velocity / speed) ** 2)))
        velocity += step * (applied - viscous * velocity - sliding - offset) / INERTIA
        position += step * velocity
    return RobotLog(
        time=time[::STEPS], joint_names=("axle",), position=positions[::STEPS, None], torque=torque[::STEPS, None]
    )


def errors(wheel: Robot, log: RobotLog, **changes: object) -> np.ndarray:
    """Compute the relative error of each parameter."""
    found = identify(log, wheel, Settings(method="curve-fit", filter=SAVGOL, **changes)).joints["axle"].parameters
    return np.array([each.value for each in found.values()]) / TRUTH - 1


def test_reversals_bend_a_law_that_is_not_averaged_and_no_other(wheel: Robot, log: RobotLog) -> None:
    plain, averaged = errors(wheel, log), errors(wheel, log, averaged_law=True)
    gain_and_speed = [2, 3]
    assert np.abs(plain[gain_and_speed]).min() > 0.15
    np.testing.assert_allclose(averaged[gain_and_speed], 0, atol=0.04)
    np.testing.assert_allclose(averaged[[0, 1, 4, 5]], 0, atol=0.01)


def test_an_averaged_law_is_right_where_the_torque_jumps_and_the_motion_is_smooth(wheel: Robot) -> None:
    time = PERIOD * np.arange(24_000)
    pulses, sizes = 2 * np.pi * np.array([0.31, 0.67, 1.3]), np.array([0.5, 0.6, 0.4])
    phases = pulses * time[:, None] + [0.3, 1.1, 2.0]
    velocity, acceleration = np.sin(phases) @ sizes, np.cos(phases) @ (sizes * pulses)
    log = RobotLog(
        time=time,
        joint_names=("axle",),
        position=(-np.cos(phases) @ (sizes / pulses))[:, None],
        torque=(INERTIA * acceleration + LAW.torque(velocity, TRUTH))[:, None],
    )
    np.testing.assert_allclose(errors(wheel, log, averaged_law=True), 0, atol=0.002)


def test_chunks_do_not_show(wheel: Robot, log: RobotLog, monkeypatch: pytest.MonkeyPatch) -> None:
    short = log.take(np.arange(len(log.time)) < 9000)
    settings = Settings(method="curve-fit", filter=SAVGOL, averaged_law=True)
    whole = identify(short, wheel, settings).evidence
    monkeypatch.setattr(stribeck.friction_torque.inverse_dynamics, "CHUNK", 997)
    pieces = identify(short, wheel, settings).evidence
    for name in ("friction_torque", "jerk", "snap"):
        expected = getattr(whole.samples, name)
        np.testing.assert_allclose(
            getattr(pieces.samples, name), expected, rtol=0, atol=1e-9 * max(1, np.abs(expected).max())
        )


def test_nothing_is_averaged_where_the_log_has_its_own_acceleration(wheel: Robot, log: RobotLog) -> None:
    velocity = np.gradient(log.position, PERIOD, axis=0)
    own = replace(log, velocity=velocity, acceleration=np.gradient(velocity, PERIOD, axis=0))
    found = [
        identify(own, wheel, Settings(method="curve-fit", filter=FilterSettings(kind="log"), averaged_law=choice))
        .joints["axle"]
        .parameters
        for choice in (False, True)
    ]
    for name, plain in found[0].items():
        assert found[1][name].value == pytest.approx(plain.value, rel=1e-9)


def test_a_filter_without_a_window_is_refused(wheel: Robot, log: RobotLog) -> None:
    settings = Settings(method="curve-fit", filter=FilterSettings(kind="butterworth", cutoff=30.0), averaged_law=True)
    with pytest.raises(SettingsError, match=r"averaged_law is true.*'butterworth' has no finite window"):
        identify(log, wheel, settings)
