"""The windows of the weak form."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import toeplitz

from stribeck.whole_log.equations.filters import derivative_kernels, smooth_window


@settings(deadline=None)
@given(period=st.floats(5e-5, 0.1))
def test_overlaps_are_of_a_covariance_at_every_rate(period: float) -> None:
    window, (_, sharp) = smooth_window(period), derivative_kernels(2e-5, period)
    for overlap in window.overlaps(sharp[2], np.ones(1)):
        correlation = np.append(overlap / overlap[0], np.zeros(15 * len(overlap)))
        correlation[0] += 1e-6
        assert np.isfinite(np.linalg.cholesky(toeplitz(correlation))).all()


@settings(deadline=None)
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
