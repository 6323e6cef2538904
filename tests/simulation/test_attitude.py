"""The base's orientation from gyroscope, standing feet and IMU."""

import numpy as np
import pinocchio as pin
import pytest

from stribeck_simulation.walking.estimator import FLAT, AttitudeFilter, AttitudeGains

PERIOD = 1e-3
STANDING, SWINGING = 1.0, 0.0


def filter_at(rotation: np.ndarray) -> AttitudeFilter:
    return AttitudeFilter(rotation, [0.0], PERIOD)


def quaternion(rotation: np.ndarray) -> np.ndarray:
    return np.asarray(pin.Quaternion(rotation).coeffs())


def update(attitude: AttitudeFilter, measured: np.ndarray, spin: np.ndarray, foot: np.ndarray, load: float) -> None:
    """Give a period's measurements, with one foot's rotation to the base."""
    attitude.correct(quaternion(measured), [attitude.turn(spin) @ foot], [load])


def followed(attitude: AttitudeFilter, measured: np.ndarray, foot: np.ndarray, load: float) -> np.ndarray:
    """Return the estimate's error [rad] after ten seconds at rest, the truth being level, shape (3,)."""
    for _ in range(10_000):
        update(attitude, measured, np.zeros(3), foot, load)
    return np.asarray(pin.log3(attitude.rotation))


def test_it_turns_with_the_gyroscope_when_the_imu_agrees() -> None:
    spin, rotation = np.array([0.3, -0.2, 0.5]), np.asarray(pin.exp3(np.array([0.1, 0.2, 0.0])))
    attitude = filter_at(rotation)
    for _ in range(2_000):
        rotation = rotation @ pin.exp3(PERIOD * spin)
        update(attitude, rotation, spin, np.eye(3), SWINGING)
    np.testing.assert_allclose(attitude.rotation, rotation, atol=1e-9)


def test_a_standing_foot_outweighs_a_wrong_imu() -> None:
    wrong = np.array([0.03, -0.02, 0.04])
    error = followed(filter_at(np.eye(3)), np.asarray(pin.exp3(wrong)), np.eye(3), STANDING)
    gains = AttitudeGains()
    np.testing.assert_allclose(error, gains.imu / (gains.imu + gains.foot) * wrong, rtol=0.1)


@pytest.mark.parametrize(
    ("tilt", "load"),
    [((0.02, 0.0, 0.0), SWINGING), ((1.1 * FLAT, 0.0, 0.0), STANDING), ((0.0, 1.1 * FLAT, 0.0), STANDING)],
)
def test_a_foot_in_the_air_or_one_that_tips_changes_nothing(tilt: tuple[float, ...], load: float) -> None:
    error = followed(filter_at(np.eye(3)), np.eye(3), np.asarray(pin.exp3(np.array(tilt))), load)
    np.testing.assert_allclose(error, 0.0, atol=1e-12)


def test_a_foot_keeps_the_heading_it_landed_with() -> None:
    turned = np.asarray(pin.exp3(np.array([0.0, 0.0, 0.3])))
    attitude = filter_at(np.eye(3))
    update(attitude, np.eye(3), np.zeros(3), turned, SWINGING)
    error = followed(attitude, np.eye(3), turned, STANDING)
    np.testing.assert_allclose(error, 0.0, atol=1e-9)
