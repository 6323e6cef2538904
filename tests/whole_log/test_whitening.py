"""Whitened errors are independent, whatever makes them."""

import numpy as np
import pytest

from stribeck.base.typing import Array
from stribeck.whole_log.noise.autocorrelation import autocorrelation, innovation_weights
from stribeck.whole_log.noise.update import update_components
from stribeck.whole_log.noise.variance_components import VarianceComponents
from stribeck.whole_log.noise.whitening import make_whitener
from stribeck.whole_log.weak_equations import WeakEquations


def some_equations(windows: int, projected: bool, seed: int = 0) -> WeakEquations:
    generator = np.random.default_rng(seed)
    joints, rows = 3, 2 if projected else 3
    taps = np.full(7, 1 / 7)
    full = np.correlate(taps, taps, mode="full")[6::3]
    sharp = np.convolve(taps, [1.0, -2.0, 1.0])
    return WeakEquations(
        time=np.arange(windows) * 0.01,
        since=0.03 + np.arange(windows) * 0.01,
        until=0.03 + np.arange(windows)[::-1] * 0.01,
        gait=-1,
        residual=generator.standard_normal((windows, rows)),
        velocity=generator.standard_normal((3 * windows + 6, joints)),
        taps=taps,
        step=3,
        standing=np.array([False, True, seed % 2 == 1]),
        projection=generator.standard_normal((windows, rows, joints)) if projected else None,
        encoder_response=generator.standard_normal((windows, rows, 4)),
        root_response=generator.standard_normal((windows, rows, 6)),
        encoder_noise=generator.uniform(0.5, 1, 4),
        torque_noise=generator.uniform(0.5, 1, joints),
        acceleration_overlap=np.correlate(sharp, sharp, mode="full")[8::3],
        torque_overlap=full,
        regressors=None,
        torque=generator.standard_normal((windows, joints)),
        elapsed=np.arange(windows) * 0.01,
        position=np.zeros((3 * windows + 6, joints)),
    )


UNREST = np.array([[3.0, 2.0, 1.5, 1.0, 2.0], [4.0, 3.0, 2.0, 1.0, 1.5]])
LEVELS = VarianceComponents(
    np.array([[0.3, 0.2, 0.4], [0.5, 0.3, 0.6]]),
    np.repeat([0.1, 0.2], 3),
    UNREST,
    np.zeros(3),
    np.zeros(3),
    np.array([1.0, 2.0, 3.0, 1.0]),
)


def covariance(equations: WeakEquations, components: VarianceComponents) -> Array:
    """As the docstring of `WeakEquations` has it, dense."""
    windows, rows = equations.residual.shape
    lags = equations.lags
    G, P = equations.encoder_response, equations.weights
    V = components.response(equations) * components.at(equations)[:, None, :]
    dense = np.zeros((windows, rows, windows, rows))
    for k in range(windows):
        for other in range(max(0, k - lags), min(windows, k + lags + 1)):
            j = abs(k - other)
            rho_a = equations.acceleration_overlap[j] if j < len(equations.acceleration_overlap) else 0.0
            part = rho_a * G[k] @ np.diag((equations.encoder_noise * components.encoder_scale) ** 2) @ G[other].T
            part += equations.torque_overlap[j] * P[k] @ np.diag(equations.torque_noise**2) @ P[other].T
            dense[k, :, other, :] = part + autocorrelation(lags)[j] * V[k] @ V[other].T
    return dense.reshape(windows * rows, windows * rows)


@pytest.mark.parametrize("windows", [1, 4, 11])
@pytest.mark.parametrize("projected", [False, True])
def test_the_whitened_covariance_is_the_identity(windows: int, projected: bool) -> None:
    equations = some_equations(windows, projected)
    whitener = make_whitener(equations, LEVELS)
    size = windows * equations.residual.shape[1]
    factor = whitener.apply(np.eye(size))
    white = factor @ covariance(equations, LEVELS) @ factor.T
    np.testing.assert_allclose(white, np.eye(size), atol=1e-9)


def test_variance_components_are_found_from_residuals() -> None:
    generator = np.random.default_rng(8)
    parts = []
    for seed in range(6):
        equations = some_equations(80, False, seed)
        factor = np.linalg.cholesky(covariance(equations, LEVELS))
        parts.append((equations, factor @ generator.standard_normal(len(factor))))
    zeros = np.zeros(3), np.zeros(3)
    components = VarianceComponents(np.full((2, 3), 1.0), np.full(6, 1.0), np.ones((2, 5)), *zeros, np.ones(4))
    for _ in range(15):
        components = update_components(components, parts)
    pilot = [0, 2, 4, 5, 6, 7, 8, 9, 10, 11]  # the first joint always swings, the second always stands
    np.testing.assert_allclose(components.away_from_contacts[pilot], LEVELS.away_from_contacts[pilot], rtol=0.5)
    assert np.all(components.contact_scale[:, 0] > 1.5)
    np.testing.assert_allclose(components.contact_scale[:, 3], 1.0)
    np.testing.assert_allclose(components.encoder_scale, LEVELS.encoder_scale, rtol=0.25)


@pytest.mark.parametrize("lags", [1, 4, 9])
def test_the_autocorrelation_has_a_positive_spectrum(lags: int) -> None:
    frequency = np.linspace(0, np.pi, 501)
    spectrum = 1 + 2 * np.cos(np.outer(frequency, np.arange(1, lags + 1))) @ autocorrelation(lags)[1:]
    assert spectrum.min() > 0.01 * spectrum.max()


@pytest.mark.parametrize("lags", [1, 4, 9])
def test_innovations_have_the_autocorrelation(lags: int) -> None:
    effect = innovation_weights(autocorrelation(lags))
    np.testing.assert_allclose(np.correlate(effect, effect, mode="full")[lags:], autocorrelation(lags), atol=1e-5)
