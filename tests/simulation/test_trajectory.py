"""Smooth signals: derivatives, bounds and ends."""

import numpy as np
import pytest

from stribeck.base.typing import Array
from stribeck_simulation.prescribed.gait import in_the_air, load_share, plan_swings, swing_window
from stribeck_simulation.prescribed.trajectory import bell, product, random_sines, smooth_step

TIME = np.linspace(-0.5, 2.5, 30001)
STEP = TIME[1] - TIME[0]


def assert_derivatives(signals: Array, scale: float = 1.0) -> None:
    difference = (signals[:2, 2:] - signals[:2, :-2]) / (2 * STEP)
    np.testing.assert_allclose(difference, signals[1:, 1:-1], atol=1e-4 * scale)


def test_sines_stay_within_reach_and_speed():
    generator = np.random.default_rng(0)
    centre, reach, speed = generator.uniform(0.1, 2, (3, 20))
    sines = random_sines(centre, reach, speed, (0.2, 2.0), generator)
    signals = sines.at(TIME)
    assert_derivatives(signals, scale=10)
    assert_derivatives(product(signals, signals[:, :, ::-1]), scale=100)
    position, velocity, _ = sines.at(np.linspace(0, 60, 6001))
    distance = np.abs(position - centre).max(axis=0) / reach
    peak = np.abs(velocity).max(axis=0) / speed
    assert distance.max() <= 1
    assert peak.max() <= 1
    assert np.maximum(distance, peak).min() > 0.6


def test_steps_begin_and_end_softly():
    signals = bell(TIME, 0.2, 1.1)
    assert_derivatives(signals, scale=100)
    assert signals[0].max() == pytest.approx(1)
    assert not signals[:, (TIME <= 0.2) | (TIME >= 1.1)].any()
    edge = np.searchsorted(TIME, 0.2) + 10
    assert abs(signals[2, edge]) < 1e-3 * np.abs(signals[2]).max()
    step = smooth_step(TIME, 0.0, 1.0)
    assert np.all(np.diff(step) >= 0)
    assert (step[0], step[-1]) == (0, 1)
    np.testing.assert_allclose(step + smooth_step(1 - TIME, 0.0, 1.0), 1, atol=1e-12)


def test_feet_in_the_air_carry_nothing_and_do_not_stop_abruptly():
    swings = plan_swings("walk", ("a", "b"), 2.5)
    for foot in ("a", "b"):
        air = in_the_air(swings, foot, TIME)
        share = load_share(swings, foot, TIME)
        assert 0 < air.mean() < 0.6
        assert share[air].max() < 1e-12
        assert share.max() == pytest.approx(1)
        assert not swing_window(swings, foot, TIME)[0][~air].any()
    either = load_share(swings, "a", TIME) + load_share(swings, "b", TIME)
    assert either.min() > 0.99  # what one foot gives up, the other takes
