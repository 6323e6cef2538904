"""Corrections are eliminated without a trace, and descents end where a dense minimiser does."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares
from tests.whole_log.synthetic import make_laws, no_fit, statistics

from stribeck.core.base.typing import Array
from stribeck.core.equations.whole_log.corrections import lay_out
from stribeck.core.equations.whole_log.corrections.correction import Layout
from stribeck.core.estimator.model.corrections import ModelCorrections, model_corrections
from stribeck.core.estimator.solver.elimination import solve
from stribeck.core.estimator.solver.gauss_newton import minimise
from stribeck.core.estimator.solver.positive_definite import inverse_of
from stribeck.core.estimator.solver.statistics import Statistics
from stribeck.core.settings import Priors

LAWS = make_laws("stribeck", 3)
FRICTION = np.array(
    [[0.3, 1.2, 0.4, 0.2, 0.1, 30.0], [0.5, 0.7, 0.2, 0.3, -0.1, 20.0], [0.1, 2.0, 0.6, 0.1, 0.0, 60.0]]
)
BODY = np.array([2.0, 0.1, -0.2, 0.3, 0.3, 0.01, 0.28, -0.02, 0.03, 0.2])


def two_bodies() -> ModelCorrections:
    """Corrections of two bodies, three gains, two zeros."""
    bodies = Layout(bodies=("a", "b"), inertial_parameters=np.stack([BODY, 0.5 * BODY]))
    return model_corrections(lay_out({"gains": 3, "zeros": 2}, bodies), np.ones(3), Priors(), 1.0)


@pytest.fixture(scope="module")
def known() -> tuple[Array, Array, Statistics]:
    """Columns and left sides of 400 equations, and their sums, where bodies are far from the model."""
    generator, model, theta = np.random.default_rng(3), two_bodies(), LAWS.coefficients(inside(FRICTION)).ravel()
    away = 1.5 * generator.standard_normal(model.layout.size)
    slopes = model.slopes(np.zeros(model.layout.size))
    size = np.concatenate([np.ones(20) * np.abs(slopes.bodies).max(axis=(0, 2)).mean(), model.scales])
    columns = generator.standard_normal((400, len(theta) + len(size)))
    columns *= np.concatenate([30 * np.ones(len(theta)), 20 / size])
    torque = columns @ np.concatenate([theta, model.values(away)]) + generator.standard_normal(400)
    return columns, torque, summed_up(columns, torque)


def summed_up(columns: Array, torque: Array) -> Statistics:
    friction = LAWS.coefficients(inside(FRICTION)).size
    return statistics(friction, columns.T @ columns, columns.T @ torque, float(torque @ torque), len(torque))


def inside(values: Array) -> Array:
    return np.where(LAWS.logarithmic, np.log(values, where=LAWS.logarithmic, out=np.zeros_like(values)), values)


def test_a_fit_ends_where_a_dense_minimiser_does(known: tuple[Array, Array, Statistics]) -> None:
    columns, torque, sums = known
    start = no_fit(LAWS, two_bodies(), inside(FRICTION * np.array([1.3, 0.8, 1.3, 0.8, 1.0, 1.5])))
    fit = solve(sums, start)
    mean, deviation = LAWS.prior
    root = np.linalg.cholesky(fit.model.precision).T

    def residuals(x: Array) -> Array:
        one = replace(fit, internal=x[:18].reshape(3, 6), corrections=x[18:])
        prior = [((one.internal - mean) / deviation).ravel(), root @ one.corrections]
        return np.concatenate([torque - columns @ one.values, *prior])

    dense = least_squares(residuals, start.x, method="lm")
    assert fit.converged
    assert np.sum(residuals(fit.x) ** 2) / 2 == pytest.approx(dense.cost, abs=0.02)
    errors = np.sqrt(np.diag(fit.covariance))
    assert np.abs((fit.x - dense.x) / errors).max() < 0.1
    steps = 1e-6 * np.eye(len(fit.x))
    jacobian = np.stack([(residuals(fit.x + s) - residuals(fit.x - s)) / 2e-6 for s in steps], axis=1)
    expected = jacobian.T @ jacobian
    scale = 1 / np.sqrt(np.diag(expected))
    scales = np.outer(scale, scale)
    np.testing.assert_allclose(fit.curvature(sums) * scales, expected * scales, atol=1e-5)
    ratio = np.diag(fit.covariance) / np.diag(np.linalg.inv(expected))
    np.testing.assert_allclose(ratio, 1.0, rtol=0.02)


@dataclass(frozen=True)
class _Exponential:
    """The costs exp(x) - 3 x, of which a Newton step from far below leads where exp overflows."""

    def of(self, rows: NDArray[np.int64]) -> "_Exponential":  # noqa: ARG002 - there is one descent
        return self

    def costs(self, x: Array) -> Array:
        return np.asarray((np.exp(x) - 3 * x)[:, 0])

    def derivatives(self, x: Array) -> tuple[Array, Array]:
        return np.exp(x) - 3, np.exp(x)[:, :, None]


def test_a_step_that_leads_where_numbers_overflow_is_not_taken() -> None:
    start = np.array([[-10.0]])
    found = minimise(_Exponential(), start, np.full_like(start, -np.inf), np.full_like(start, np.inf))
    assert found.converged.all()
    assert found.x[0, 0] == pytest.approx(np.log(3), abs=0.05)
    held = minimise(_Exponential(), start, np.full_like(start, -np.inf), np.full_like(start, 0.5))
    assert held.x[0, 0] == 0.5


def test_where_rounding_leaves_nothing_of_a_prior_variances_are_those_of_rounding() -> None:
    """Two parameters whose sum alone a log shows, a third one, and a prior that is lost beside the log's share."""
    together = np.array([1.0, 1.0, 0.0])
    found = inverse_of(1e5 * np.outer(together, together) + np.diag([1e-14, 1e-14, 4.0]))
    assert min(found[0, 0], found[1, 1]) > 1e8
    np.testing.assert_allclose(found[:2, :2] / found[0, 0], [[1.0, -1.0], [-1.0, 1.0]], rtol=1e-6)
    np.testing.assert_allclose(found[2], [0.0, 0.0, 0.25], atol=1e-6)
