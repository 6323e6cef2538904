"""The windows of the weak form."""

import numpy as np
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
