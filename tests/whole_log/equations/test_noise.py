"""Noise is measured from the log itself, and spikes are replaced."""

import numpy as np
import pytest

from stribeck.core.equations.whole_log.filters import smooth_window
from stribeck.core.equations.whole_log.noise import measure_noise, without_spikes

TIME = np.arange(20_000) / 1000.0
MOTION = np.column_stack([np.sin(9 * TIME), 0.3 * np.cos(17 * TIME)])


def test_white_noise_is_measured_within_five_percent() -> None:
    generator = np.random.default_rng(0)
    position = MOTION + [2e-5, 1e-4] * generator.standard_normal(MOTION.shape)
    torque = 30 * MOTION + [0.1, 0.3] * generator.standard_normal(MOTION.shape)
    found = measure_noise(position, torque, (slice(0, 9_000), slice(9_000, 20_000)))
    np.testing.assert_allclose(found.position, [2e-5, 1e-4], rtol=0.05)
    np.testing.assert_allclose(found.torque, [0.1, 0.3], rtol=0.05)


def test_a_coarse_encoder_has_the_noise_of_its_steps() -> None:
    step = 1e-3
    for speed in (0.1, 0.01):
        slow = np.round(speed * MOTION / step) * step
        found = measure_noise(slow, 30 * MOTION, (slice(0, len(TIME)),))
        assert np.all(found.position > 0.9 * step / np.sqrt(12))
        assert np.all(found.position < 2.0 * step / np.sqrt(12))


@pytest.mark.parametrize("period", [1e-4, 1e-3, 2e-3, 5e-3, 1e-2, 5e-2])
def test_windows_of_white_noise_have_the_autocovariance(period: float) -> None:
    window = smooth_window(period)
    kernel = np.array([1.0, -2.0, 1.0])
    overlap, longer = window.overlaps(kernel, np.array([1.0, 0.0, 0.0]))
    assert len(overlap) == len(longer) >= 2
    noise = np.random.default_rng(1).standard_normal((300_000, 1))
    windows = window.apply(np.convolve(noise[:, 0], kernel, mode="valid")[:, None])[:, 0]
    for lag in range(len(overlap) + 2):
        found = np.mean(windows[lag:] * windows[: len(windows) - lag])
        expected = overlap[lag] if lag < len(overlap) else 0.0
        assert found == pytest.approx(expected, abs=6 * overlap[0] / np.sqrt(len(windows)))
    assert window.taps.sum() == pytest.approx(1.0)


SIZE = 2e-3
SHORT = np.arange(6000) / 1000
WHOLE = (slice(0, len(SHORT)),)


def channel(seed: int = 0) -> np.ndarray:
    """Smooth motion, a torque that reverses within one, and a blow of 20 ms, all with noise; shape (T, 3)."""
    smooth = np.sin(2 * np.pi * 1.5 * SHORT)
    blow = 5 * np.exp(-(((SHORT - 2.5) / 0.006) ** 2))
    exact = np.column_stack([smooth, smooth + np.sign(np.cos(2 * np.pi * 1.5 * SHORT)), smooth + blow])
    return exact + SIZE * np.random.default_rng(seed).standard_normal(exact.shape)


@pytest.mark.parametrize("size", [20.0, 1000.0])
def test_spikes_are_replaced_by_values_between_their_neighbors(size: float) -> None:
    signal, generator = channel(), np.random.default_rng(1)
    there = generator.random(signal.shape) < 0.01
    spiked = signal + size * SIZE * there * generator.choice([-1.0, 1.0], signal.shape)
    cleaned, count = without_spikes(spiked, WHOLE, 0.0, smooth=False)
    assert count > 0.9 * there.sum()
    assert (cleaned != spiked)[~there].sum() < 0.1 * count
    error = np.abs(cleaned - signal)
    assert np.mean(error[there] < 5 * SIZE) > 0.9
