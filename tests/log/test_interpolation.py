"""Properties of interpolation: it passes through the samples, and preserves the kind of signal."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from stribeck.log.interpolation import bridges, cubic, linear, previous, slerp

TIME = np.array([0.0, 0.1, 0.25, 0.3, 0.6])
RNG = np.random.default_rng(0)


@pytest.mark.parametrize("method", [linear, cubic, previous])
def test_samples_are_met(method):
    values = RNG.normal(size=(5, 3))
    np.testing.assert_allclose(method(TIME, TIME, values), values, atol=1e-12)
    np.testing.assert_allclose(method(np.array([-1.0, 2.0]), TIME, values), values[[0, -1]], atol=1e-12)


def test_polynomials_are_met_up_to_the_order_of_the_method():
    query = np.linspace(0, 0.6, 50)
    line = lambda t: np.stack([1 + 2 * t, -t], axis=1)  # noqa: E731
    cube = lambda t: np.stack([t**3 - t, 2 * t**2], axis=1)  # noqa: E731
    np.testing.assert_allclose(linear(query, TIME, line(TIME)), line(query), atol=1e-12)
    np.testing.assert_allclose(cubic(query, TIME, cube(TIME)), cube(query), atol=1e-12)


def test_orientations_turn_at_constant_speed_the_short_way():
    rotations = Rotation.random(5, rng=1)
    quaternions = rotations.as_quat() * np.array([1, -1, 1, 1, -1])[:, None]
    query = np.linspace(0, 0.6, 40)
    ours = Rotation.from_quat(slerp(query, TIME, quaternions))
    assert (ours.inv() * Slerp(TIME, rotations)(query)).magnitude().max() < 1e-7


def test_bridges_are_between_samples_too_far_apart_and_outside():
    query = np.array([-0.1, 0.0, 0.05, 0.2, 0.3, 0.4, 0.6, 0.7])
    expected = [True, False, False, False, False, True, False, True]
    np.testing.assert_array_equal(bridges(query, TIME, 0.2), expected)


def test_blocks_leave_no_seams(monkeypatch):
    time = np.cumsum(RNG.uniform(0.5, 1.5, 2000))
    query = np.sort(RNG.uniform(time[0], time[-1], 1500))
    values, turns = RNG.normal(size=(2000, 3)), Rotation.random(2000, rng=2).as_quat()
    whole = cubic(query, time, values), slerp(query, time, turns)
    monkeypatch.setattr("stribeck.log.interpolation.BLOCK_ROWS", 100)
    np.testing.assert_allclose(cubic(query, time, values), whole[0], atol=1e-12)
    np.testing.assert_array_equal(slerp(query, time, turns), whole[1])
