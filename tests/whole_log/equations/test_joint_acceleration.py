"""Accelerations that corrections act on: their noise is a small share of the motion, whatever a joint does."""

import numpy as np
import pytest

from stribeck.base.typing import Array
from stribeck.whole_log.equations.filters import JointAcceleration, joint_acceleration, savgol, smooth_window

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


def kernels(position: Array, segments: tuple[slice, ...] = WHOLE) -> JointAcceleration:
    return joint_acceleration(position, NOISE, segments, PERIOD, WINDOW, savgol(0.04, PERIOD)[2])


def test_next_to_nothing_is_lost_of_the_motion() -> None:
    position, acceleration = motion()
    noise = NOISE * np.random.default_rng(1).standard_normal(position.shape)
    away_from_contacts = kernels(position + noise)
    found, true = away_from_contacts.windows(position + noise, 200, 29_800), WINDOW.apply(acceleration[200:29_800])
    assert found.shape == true.shape
    slope = np.sum(found * true, axis=0)[:3] / np.sum(found**2, axis=0)[:3]  # what an inertia would come out as
    np.testing.assert_allclose(slope, 1.0, atol=0.01)


@pytest.mark.parametrize("period", [1e-4, 2e-3, 1e-2, 5e-2])
def test_windows_are_there_at_every_rate(period: float) -> None:
    window = smooth_window(period)
    time = period * np.arange(4_000)
    position = np.sin(2.0 * time)[:, None]
    away_from_contacts = joint_acceleration(
        position, np.array([1e-5]), (slice(0, 4_000),), period, window, savgol(0.03, period)[2]
    )
    margin = away_from_contacts.margin
    found = away_from_contacts.windows(position, margin, 4_000 - margin)
    true = window.apply(-4.0 * position[margin : 4_000 - margin])
    assert found.shape == true.shape
    np.testing.assert_allclose(found, true, atol=0.05)
