"""Whitened errors are independent, whatever makes them, and residuals show how large errors are."""

from dataclasses import replace

import numpy as np
import pytest
from tests.whole_log.synthetic import some_equations

from stribeck.core.base.typing import Array
from stribeck.core.equations.weak_equations import WeakEquations, autocorrelation
from stribeck.core.estimator.noise.likelihood import make_groups, more_likely
from stribeck.core.estimator.noise.outliers import CONTRADICTS, Prediction, outlying_windows
from stribeck.core.estimator.noise.variance_components import VarianceComponents
from stribeck.core.estimator.noise.whitening import make_whitener

TRUTH = VarianceComponents(
    np.array([[0.3, 0.2, 0.4], [0.5, 0.3, 0.6]]),
    np.repeat([0.1, 0.2], 3),
    np.array([[3.0, 2.0, 1.5, 1.0, 2.0], [4.0, 3.0, 2.0, 1.0, 1.5]]),
    np.zeros(3),
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
    dense = covariance(equations, TRUTH)
    factor = np.eye(len(dense))
    whitener = make_whitener(equations, TRUTH)
    whitener.whiten(factor)
    np.testing.assert_allclose(factor @ dense @ factor.T, np.eye(len(dense)), atol=1e-9)
    whitener.whiten_back(factor)
    np.testing.assert_allclose(factor @ dense, np.eye(len(dense)), atol=1e-9)
    np.testing.assert_allclose(TRUTH.marginal(equations).ravel(), np.diag(dense))


def test_means_of_windows_have_the_variance_of_their_sensors() -> None:
    equations = some_equations(4, False)
    response = np.broadcast_to(equations.encoder_response[:1], equations.encoder_response.shape)
    equations, sensors = (
        replace(equations, encoder_response=response),
        replace(TRUTH, model=0 * TRUTH.model, root=np.zeros(6)),
    )
    mean = np.kron(np.full((1, 4), 0.25), np.eye(3))
    expected = np.diag(mean @ covariance(equations, sensors) @ mean.T)
    np.testing.assert_allclose(sensors.marginal(equations, 4)[0], expected)


def test_groups_are_whitened_by_themselves() -> None:
    equations = some_equations(23, True)
    groups = make_groups(equations, 0, 2, np.column_stack([np.arange(46.0), np.ones(46)]))
    whitener, size = groups.whitener(TRUTH), equations.lags * 2
    dense = covariance(equations, TRUTH)
    assert len(whitener) == -(-(23 // equations.lags) // 2)
    for k, factor in enumerate(whitener):
        own = slice(2 * k * size, (2 * k + 1) * size)
        np.testing.assert_allclose(factor @ dense[own, own] @ factor.T, np.eye(size), atol=1e-9)
        np.testing.assert_array_equal(groups.design[k, :, 0], np.arange(46.0)[own])


def test_rejected_windows_have_no_influence() -> None:
    equations = some_equations(11, False)
    aside = np.arange(11) == 4
    rows = equations.residual.reshape(-1, 1).copy()
    make_whitener(equations, TRUTH).whiten(rows)
    object.__setattr__(equations, "set_aside", aside)
    white, disturbed = equations.residual.reshape(-1, 1).copy(), equations.residual.copy()
    disturbed[aside] += 5.0
    make_whitener(equations, TRUTH).whiten(white)
    disturbed = disturbed.reshape(-1, 1)
    make_whitener(equations, TRUTH).whiten(disturbed)
    assert np.sum(rows**2) > 1.01 * np.sum(white**2)
    np.testing.assert_allclose(disturbed, white, atol=0.02)


def test_variance_components_are_found_from_residuals() -> None:
    generator, parts = np.random.default_rng(8), []
    for seed in range(12):
        equations = some_equations(80, False, seed)
        factor = np.linalg.cholesky(covariance(equations, TRUTH))
        residual = factor @ generator.standard_normal(len(factor))
        groups = make_groups(equations, 0, 1, residual[:, None])
        parts.append((groups, groups.design[:, :, 0]))
    zeros = np.zeros(3), np.zeros(3), np.zeros(3)
    components = VarianceComponents(np.full((2, 3), 1.0), np.full(6, 1.0), np.ones((2, 5)), *zeros, np.ones(4))
    for _ in range(15):
        whitened = [(groups, groups.whitener(components), residual) for groups, residual in parts]
        components = more_likely(components, whitened, np.zeros((0, 0)))
    shown = [0, 2, 4, 5, 6, 7, 8, 9, 10, 11]  # the first joint always swings, the second always stands
    np.testing.assert_allclose(components.away_from_contacts[shown], TRUTH.away_from_contacts[shown], rtol=0.5)
    assert np.ptp(components.root[:3]) == np.ptp(components.root[3:]) == 0  # one for all directions
    assert np.all(components.contact_scale[:, 0] > 1.5)
    np.testing.assert_allclose(components.contact_scale[:, 3], 1.0)
    np.testing.assert_allclose(components.encoder_scale, TRUTH.encoder_scale, rtol=0.25)


def test_friction_is_uncertain_where_the_filter_hides_a_reversal():
    equations = some_equations(80, False, 3)
    slow = np.array([0.0, 0.0, 0.01])
    fast = np.ones(len(equations.velocity))
    reverses = np.where(np.arange(len(fast)) < 40, 1.0, -1.0)
    equations = replace(equations, velocity=np.stack([fast, reverses, 0.001 * fast], axis=1), blur=6)
    near = np.abs(np.arange(len(fast)) - 39.5) < 6
    share = equations.windows(np.stack([0 * near, near, fast], axis=1))
    components = replace(TRUTH, model=0 * TRUTH.model, rest=slow, stiction=np.full(3, 7.0), reversal=np.full(3, 0.4))
    expected = np.hypot(share * 0.4, share * np.array([0, 0, 7.0]))
    np.testing.assert_allclose(components.at(equations)[:, :3], expected, atol=1e-12)


@pytest.mark.parametrize("lags", [1, 4, 9])
def test_the_autocorrelation_has_a_positive_spectrum(lags: int) -> None:
    frequency = np.linspace(0, np.pi, 501)
    spectrum = 1 + 2 * np.cos(np.outer(frequency, np.arange(1, lags + 1))) @ autocorrelation(lags)[1:]
    assert spectrum.min() > 0.01 * spectrum.max()
    assert autocorrelation(2 * lags - 1)[lags] == pytest.approx(0.25)  # half of the reach is left, squared


def test_an_outlier_lasts_as_long_as_its_shoulders() -> None:
    sizes = np.array([[1.0, 5.0, 20.0, 6.0, 1.0, 5.0, 1.0], [1.0, 1.0, 7.0, 1.0, 5.0, 1.0, 1.0]]).T
    np.testing.assert_array_equal(np.flatnonzero(outlying_windows(sizes, 10.0)), [1, 2, 3, 4, 5])
    assert not outlying_windows(sizes, 21.0).any()


def test_a_segment_contradicts_the_pilot_by_its_marginal_chi_square() -> None:
    generator = np.random.default_rng(1)
    for size in np.geomspace(1, 30, 20):
        design, values, spread = (generator.standard_normal(shape) for shape in ((20, 8), 8, (8, 8)))
        spread[0] = 0.0  # held
        prediction = Prediction(values, covariance := spread @ spread.T, TRUTH, 1.0)
        residual = size * generator.standard_normal(20)
        left, marginal = design @ values + residual, np.eye(20) + design @ covariance @ design.T
        expected = residual @ np.linalg.solve(marginal, residual) > CONTRADICTS * 20
        assert prediction.contradicts(design.T @ design, design.T @ left, float(left @ left), 20) == expected
