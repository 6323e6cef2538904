"""Presliding: friction lags behind reversals by travel, not by time."""

import numpy as np
import pytest

from stribeck.friction.presliding import lag_behind

TRAVEL, SMOOTH = 0.01, 1e-3


def reversal(speed: float, period: float) -> np.ndarray:
    """Compute the lag versus travel after a reversal from steady sliding, for a grid of travels."""
    velocity = speed * np.repeat([-1.0, 1.0], round(0.1 / (speed * period)))[:, None]
    lag = lag_behind(velocity, period, SMOOTH, np.full((1, 1), TRAVEL))[0, len(velocity) // 2 :, 0]
    travelled = speed * period * np.arange(1, len(lag) + 1)
    return np.interp([0.002, 0.01, 0.03, 0.09], travelled, lag)


@pytest.mark.parametrize("speed", [0.05, 0.5])
def test_friction_comes_back_within_the_travel_at_any_speed(speed: float) -> None:
    expected = -2 * np.exp(-np.array([0.002, 0.01, 0.03, 0.09]) / TRAVEL)
    np.testing.assert_allclose(reversal(speed, 1e-3), expected, rtol=0.05)


def test_a_joint_that_stops_keeps_its_deflection() -> None:
    velocity = np.concatenate([np.full(1000, 0.1), np.full(50, -0.1), np.zeros(50)])[:, None]
    lag = lag_behind(velocity, 1e-3, SMOOTH, np.full((1, 1), TRAVEL))[0, :, 0]
    z = lag + np.tanh(velocity[:, 0] / SMOOTH)
    np.testing.assert_allclose(z[1050:], z[1049])
