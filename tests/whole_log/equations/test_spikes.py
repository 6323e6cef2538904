"""Spikes are found beside their neighbours; steps, peaks and noise are left as they are."""

import numpy as np
import pytest

from stribeck.whole_log.equations.noise import without_spikes

NOISE = 2e-3
TIME = np.arange(6000) / 1000
WHOLE = (slice(0, len(TIME)),)


def channel(seed: int = 0) -> np.ndarray:
    """Smooth motion, a torque that reverses within one, and a blow of 20 ms, all with noise; shape (T, 3)."""
    smooth = np.sin(2 * np.pi * 1.5 * TIME)
    blow = 5 * np.exp(-(((TIME - 2.5) / 0.006) ** 2))
    exact = np.column_stack([smooth, smooth + np.sign(np.cos(2 * np.pi * 1.5 * TIME)), smooth + blow])
    return exact + NOISE * np.random.default_rng(seed).standard_normal(exact.shape)


def test_what_robots_do_is_left_alone() -> None:
    signal = channel()
    same, count = without_spikes(signal, WHOLE, 0.0, smooth=False)
    assert count == 0
    assert same is signal


@pytest.mark.parametrize("size", [20.0, 1000.0])
def test_spikes_are_replaced_by_what_is_between_their_neighbours(size: float) -> None:
    signal, generator = channel(), np.random.default_rng(1)
    there = generator.random(signal.shape) < 0.01
    spiked = signal + size * NOISE * there * generator.choice([-1.0, 1.0], signal.shape)
    cleaned, count = without_spikes(spiked, WHOLE, 0.0, smooth=False)
    assert count > 0.9 * there.sum()
    assert (cleaned != spiked)[~there].sum() < 0.1 * count
    error = np.abs(cleaned - signal)
    assert np.mean(error[there] < 5 * NOISE) > 0.9
