"""Each error of a sensor has the size its profile states, and a seed gives the same errors again."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from stribeck.core.log import RobotLog
from stribeck.simulation.sensors.measure import measure, sensors_for
from stribeck.simulation.sensors.profiles import PROFILES, SensorProfile

SAMPLES, JOINTS, PERIOD = 10_000, 20, 0.001
RAMP = np.linspace(0.0, 1.0, SAMPLES)


def exact_log() -> RobotLog:
    """A slow ramp in every channel."""
    turn = Rotation.from_rotvec(np.column_stack([0.3 * RAMP, -0.2 * RAMP, 2.0 * RAMP]))
    joints = np.tile(RAMP[:, None], JOINTS)
    return RobotLog(
        time=np.arange(SAMPLES) * PERIOD,
        joint_names=tuple(f"joint_{k}" for k in range(JOINTS)),
        torque=10 * joints,
        base_orientation=turn.as_quat(),
        **dict.fromkeys(("position", "velocity", "acceleration"), joints),
        **dict.fromkeys(("angular_velocity", "linear_acceleration"), np.tile(RAMP[:, None], 3)),
        foot_names=("left", "right"),
        contact=np.tile((RAMP > 0.5)[:, None], 2),
        foot_wrench=np.tile(RAMP[:, None, None], (2, 6)),
    )


LOG = exact_log()
BRIEF = LOG.take(slice(0, 10))
COARSE = LOG.take(slice(0, None, 20))


def measured(seed: int = 0, exact: RobotLog = LOG, **profile: float) -> RobotLog:
    return measure(exact, sensors_for(exact, SensorProfile(**profile), seed))


def turn_error(exact: RobotLog, log: RobotLog) -> np.ndarray:
    """Return the rotation vectors from the true to the measured orientation, in the IMU's axes, shape (T, 3)."""
    return (Rotation.from_quat(exact.base_orientation).inv() * Rotation.from_quat(log.base_orientation)).as_rotvec()


@pytest.mark.parametrize(
    ("channel", "noise", "bias"),
    [
        ("position", "position_noise", "position_bias"),
        ("torque", "torque_noise", "torque_offset"),
        ("angular_velocity", "gyroscope_noise", "gyroscope_bias"),
        ("linear_acceleration", "accelerometer_noise", "accelerometer_bias"),
    ],
)
def test_noise_is_white_and_bias_constant(channel, noise, bias):
    """A density d [1/sqrt(Hz)] sampled at rate f has the standard deviation d sqrt(f / 2)."""
    exact = LOG.channels()[channel]
    error = measured(**{noise: 0.02}).channels()[channel] - exact
    expected = 0.02 * np.sqrt(500) if noise.startswith(("gyroscope", "accelerometer")) else 0.02
    np.testing.assert_allclose(error.std(axis=0), expected, rtol=0.03)
    assert np.abs(np.sum(error[1:] * error[:-1], axis=0) / np.sum(error**2, axis=0)).max() < 0.03
    assert np.abs(error.mean(axis=0)).max() < 0.05 * expected
    exact = BRIEF.channels()[channel]
    constant = np.concatenate(
        [(measured(seed, BRIEF, **{bias: 0.5}).channels()[channel] - exact)[[0, -1]] for seed in range(100)], axis=1
    )
    np.testing.assert_allclose(constant[0], constant[1], atol=1e-12)
    assert constant.std() == pytest.approx(0.5, rel=0.1)


def test_encoders_have_steps_torque_offsets_drift_and_time_stamps_jitter():
    step = 0.01
    log = measured(position_resolution=step, torque_drift=6.0, jitter=2e-5)
    np.testing.assert_allclose(log.position / step, np.round(log.position / step), atol=1e-9)
    error = log.position - LOG.position
    assert np.abs(error).max() <= step / 2 * (1 + 1e-9)
    assert error.std() == pytest.approx(step / np.sqrt(12), rel=0.02)
    drift = log.torque - LOG.torque
    np.testing.assert_allclose(drift[-1], 2 * drift[SAMPLES // 2], rtol=1e-3)
    assert drift[-1].std() == pytest.approx(6.0 * SAMPLES * PERIOD / 60, rel=0.5)
    assert (log.time - LOG.time).std() == pytest.approx(2e-5, rel=0.03)
    assert np.all(np.diff(measured(jitter=5e-3).time) > 0)


def test_orientation_is_off_by_a_constant_and_wanders():
    constant = turn_error(LOG, measured(orientation_bias=0.01))
    np.testing.assert_allclose(constant, np.broadcast_to(constant[0], constant.shape), atol=1e-12)
    biases = [turn_error(BRIEF, measured(seed, BRIEF, orientation_bias=0.01))[0] for seed in range(100)]
    assert np.std(biases) == pytest.approx(0.01, rel=0.15)
    wandering = np.array([turn_error(COARSE, measured(seed, COARSE, orientation_noise=0.01)) for seed in range(100)])
    assert wandering.std() == pytest.approx(0.01, rel=0.1)
    assert wandering[:, 0].std() == pytest.approx(0.01, rel=0.15)
    apart = wandering[:, :-250] * wandering[:, 250:]  # 5 s
    assert apart.mean() / wandering.var() == pytest.approx(np.exp(-1), abs=0.15)
    assert np.diff(wandering, axis=1).std() == pytest.approx(0.01 * np.sqrt(2 * 0.02 / 5), rel=0.05)


def test_imu_and_feet_are_late_and_joints_are_not():
    log, prompt = (measured(delay=delay, torque_noise=0.1) for delay in (0.005, 0.0))
    np.testing.assert_array_equal(log.position, LOG.position)
    np.testing.assert_array_equal(log.torque, prompt.torque)
    for name in ("base_orientation", "angular_velocity", "linear_acceleration", "contact", "foot_wrench"):
        np.testing.assert_allclose(log.channels()[name][5:], LOG.channels()[name][:-5], atol=1e-15)


def test_a_controller_measures_the_values_of_the_log():
    """Sample by sample as all at once."""
    sensors = sensors_for(LOG, PROFILES["harsh"], seed=3)
    log = measure(LOG, sensors)
    for k in (0, 7, 1234):
        late = max(k - sensors.late, 0)
        np.testing.assert_array_equal(sensors.position(k, LOG.position[k]), log.position[k])
        np.testing.assert_array_equal(sensors.torque(k, LOG.torque[k]), log.torque[k])
        np.testing.assert_allclose(
            sensors.orientation(k, LOG.base_orientation[late]), log.base_orientation[k], atol=1e-15
        )
        np.testing.assert_array_equal(sensors.foot_wrench(k, LOG.foot_wrench[late]), log.foot_wrench[k])
        assert sensors.time(k, LOG.time[k]) == log.time[k]
