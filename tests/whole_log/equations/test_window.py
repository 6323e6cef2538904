"""Windows of the weak form, noise of accelerations, and rows that late torques remove."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import toeplitz
from tests.whole_log.logs import arm_log, read_arm

from stribeck import Robot, Settings, identify
from stribeck.core.base.typing import Array
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.equations.whole_log.build import weak_form
from stribeck.core.equations.whole_log.equation_sequence import EquationSequence, equation_sequence
from stribeck.core.equations.whole_log.filters import (
    Acceleration,
    acceleration_filter,
    derivative_kernels,
    derivatives,
    lengthened,
    savgol,
    smooth_window,
    turn_filter,
)


@given(period=st.floats(5e-5, 0.1))
def test_overlaps_are_of_a_covariance_at_every_rate(period: float) -> None:
    window, (_, sharp) = smooth_window(period), derivative_kernels(2e-5, period)
    for overlap in window.overlaps(sharp[2], np.ones(1)):
        correlation = np.append(overlap / overlap[0], np.zeros(15 * len(overlap)))
        correlation[0] += 1e-6
        assert np.isfinite(np.linalg.cholesky(toeplitz(correlation))).all()


@given(period=st.floats(1.2e-3, 0.01), turn=st.floats(-0.01, 0.01))
def test_friction_of_a_joint_that_reverses_between_samples_is_averaged_exactly(period: float, turn: float) -> None:
    window = smooth_window(period)
    half = len(window.taps) // 2 + window.edge
    rows = np.arange(-half, half + 1)
    velocity = window.refine(period * rows[:, None] - turn)
    found = window.fine_taps @ np.sign(velocity[:, 0])
    exact = np.interp(np.linspace(-half, half, 100_001), rows, np.pad(window.taps, window.edge))
    time = period * np.linspace(-half, half, 100_001)
    assert found == pytest.approx(np.sign(time - turn) @ exact / exact.sum(), abs=20 * period)


@pytest.mark.parametrize(("speed", "noise", "longer"), [(1.0, 1e-3, True), (1.0, 1e-6, False), (60.0, 2e-3, False)])
def test_the_window_of_velocities_grows_where_noise_matters_and_motion_allows(speed, noise, longer):
    time = 0.01 * np.arange(3000)[:, None]
    position = 0.1 * np.sin(speed * time) + noise * np.random.default_rng(0).standard_normal(time.shape)
    first, _ = derivative_kernels(noise, 0.01)
    found = lengthened(first, position, np.full(1, noise), (slice(0, 3000),), 0.01)
    assert (found.shape[1] > first.shape[1]) == longer
    assert found.shape[1] * 0.01 <= 0.2
    if longer:
        truth = 0.1 * speed * np.cos(speed * time[500:2500])
        before, after = (derivatives(position, 500, 2500, each, (1,))[0] - truth for each in (first, found))
        assert np.std(after) < 0.5 * np.std(before)


def test_slow_friction_is_right_in_a_log_with_a_noisy_encoder(tmp_path: Path) -> None:
    """Noise of the velocity, 10 mm/s with the first window, would make friction rise half as quickly as it does."""
    inertia = '<inertial><mass value="20"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    (tmp_path / "lift.urdf").write_text(
        f'<robot name="lift"><link name="base"/><link name="carriage">{inertia}</link>'
        '<joint name="lift" type="prismatic"><parent link="base"/><child link="carriage"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="1" effort="1000" velocity="1"/></joint></robot>'
    )
    text = '[robot]\nmodel = "lift.urdf"\nbase = "fixed"\ntorque_source = "motor_current"\n'
    (tmp_path / "robot.toml").write_text(text)
    time, generator = 0.01 * np.arange(6000), np.random.default_rng(1)
    turns = 2 * np.pi * np.array([0.07, 0.13, 0.23])
    size, phase = np.array([0.15, 0.06, 0.025]), generator.uniform(0, 6, 3)
    angle = np.multiply.outer(time, turns) + phase
    position, velocity = np.sin(angle) @ size, np.cos(angle) @ (size * turns)
    acceleration = -np.sin(angle) @ (size * turns**2)
    force = 20 * (9.81 + acceleration) + 60.7 * np.tanh(200 * velocity) + 40 * velocity
    noisy = position + 2e-4 * generator.standard_normal(6000), force + 0.5 * generator.standard_normal(6000)
    position, torque = (each[:, None] for each in noisy)
    np.savez(tmp_path / "log.npz", time=time, position=position, torque=torque, joint_names=["lift"])
    joint = identify(tmp_path / "log.npz", Robot.from_file(tmp_path / "robot.toml")).joints["lift"]
    assert joint.verdict == "identified"
    assert joint.parameters["slope"].value == pytest.approx(200, rel=0.1)
    for point in joint.curve:
        truth = 60.7 * np.tanh(200 * point.velocity) + 40 * point.velocity
        assert point.value == pytest.approx(truth, abs=1.5 * point.half_width + 0.1)


PERIOD = 1e-3
TIME = PERIOD * np.arange(30_000)
SPEED = 2 * np.pi * np.array([2.0, 1.0, 1.0, 1.0])
SIZE = np.array([0.1, 0.1, 0.03, 0.0])
"""Of four joints: a quick one, a slow one, one that hardly moves, one that stands still."""
NOISE = np.full(4, 1e-4)
WINDOW = smooth_window(PERIOD)
WHOLE = (slice(0, len(TIME)),)


def motion() -> tuple[Array, Array]:
    """Return positions and accelerations, shape (T, 4) each."""
    position = SIZE * np.sin(SPEED * TIME[:, None])
    return position, -(SPEED**2) * position


def kernels(position: Array, segments: tuple[slice, ...] = WHOLE) -> Acceleration:
    return acceleration_filter(position, NOISE, segments, PERIOD, WINDOW, savgol(0.04, PERIOD)[2])


def test_almost_all_of_the_motion_is_kept() -> None:
    position, acceleration = motion()
    noise = NOISE * np.random.default_rng(1).standard_normal(position.shape)
    away_from_contacts = kernels(position + noise)
    found, true = away_from_contacts.windows(position + noise, 200, 29_800), WINDOW.apply(acceleration[200:29_800])
    assert found.shape == true.shape
    slope = np.sum(found * true, axis=0)[:3] / np.sum(found**2, axis=0)[:3]  # what an inertia would come out as
    np.testing.assert_allclose(slope, 1.0, atol=0.01)


@pytest.mark.parametrize(("noise", "rate_noise"), [(1e-3, 0.0), (0.0, 0.1)], ids=["orientation", "gyroscope"])
def test_noise_of_the_base_takes_nothing_off_its_inertia(noise: float, rate_noise: float) -> None:
    pace, generator = np.array([15.0, 12.0, 9.0]), np.random.default_rng(2)
    angle = 0.05 * np.sin(pace * TIME[:, None]) / 2
    error = noise / 2 * generator.standard_normal(angle.shape)
    error += rate_noise / 2 * PERIOD * np.cumsum(generator.standard_normal(angle.shape), axis=0)
    turn = np.hstack([angle + error, np.ones((len(TIME), 1))])
    parts = [turn[first : first + 300] for first in range(0, 30_000, 500)]
    kernel = derivative_kernels(2e-5, PERIOD)[0][2]
    turns = turn_filter(parts, rate_noise, PERIOD, WINDOW, kernel)
    white = np.convolve(error[:, 0], kernel, mode="valid").std() / np.linalg.norm(kernel)  # as noisy accelerations
    spans = tuple(slice(300 * k, 300 * (k + 1)) for k in range(len(parts)))
    like = acceleration_filter(np.concatenate(parts), np.full(4, white), spans, PERIOD, WINDOW, kernel)
    np.testing.assert_allclose(*(np.sum(each.kernels[:3] != 0, axis=1) for each in (turns, like)), rtol=0.05)
    found = turns.windows(turn, 300, 29_700)[:, :3]
    true = WINDOW.apply(-(pace**2) * angle[300:29_700])
    slope = np.sum(found * true, axis=0) / np.sum(found**2, axis=0)
    np.testing.assert_allclose(slope, 1.0, atol=0.03)


@pytest.mark.parametrize("period", [1e-4, 2e-3, 1e-2, 5e-2])
def test_windows_are_there_at_every_rate(period: float) -> None:
    window = smooth_window(period)
    time = period * np.arange(4_000)
    position = np.sin(2.0 * time)[:, None]
    kernel, size = savgol(0.03, period)[2], np.array([1e-5])
    away_from_contacts = acceleration_filter(position, size, (slice(0, 4_000),), period, window, kernel)
    margin = away_from_contacts.margin
    found = away_from_contacts.windows(position, margin, 4_000 - margin)
    true = window.apply(-4.0 * position[margin : 4_000 - margin])
    assert found.shape == true.shape
    np.testing.assert_allclose(found, true, atol=0.05)


@pytest.fixture(scope="module")
def undelayed() -> EquationSequence:
    robot, settings = read_arm(), Settings(corrections="inertia")
    form = weak_form(robot, prepare(arm_log(8.0), robot, settings), np.arange(len(robot.joint_names)), settings)
    return equation_sequence([form], np.ones(len(form.joints)))


@pytest.mark.parametrize("delay", [-0.1, 0.1])
def test_longer_delays_cut_rows_at_the_ends_of_the_log(undelayed: EquationSequence, delay: float) -> None:
    delayed = undelayed.delayed(delay)
    (log, first, _), (_, last, _) = delayed.parts[0], delayed.parts[-1]
    late = round(delay / delayed.forms[log].period)
    assert len(delayed) == len(undelayed)
    assert first.first + late >= first.unbroken.start
    assert last.last + late <= last.unbroken.stop
    assert delayed.parts[1:-1] == undelayed.parts[1:-1]
