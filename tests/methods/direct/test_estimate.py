"""Direct least squares: weights of disturbed rows, clusters of two kinds, and logs that show next to nothing."""

import numpy as np
import pytest

from stribeck.methods.direct.estimate import Regression, _two_way, fit_direct
from stribeck.methods.direct.rows import DirectRows, Weights

BODY = np.array([[2.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.1, 0.0, 0.0, 0.1]])
"""Mass, first moments and inertia."""


@pytest.mark.parametrize("regression", ["ordinary", "weighted", "robust"])
def test_torques_that_are_the_models_to_the_last_digit_have_no_friction(regression: Regression) -> None:
    generator = np.random.default_rng(0)
    velocity = generator.normal(size=400)
    columns = np.column_stack([generator.normal(size=(400, 10)), velocity, np.sign(velocity)])
    rows = DirectRows(
        left=np.zeros((400, 1)),
        columns=columns[:, None],
        effects=np.zeros((400, 0, 1)),
        used=np.ones((400, 1), dtype=bool),
        kind=np.zeros(1, dtype=np.int64),
        clusters=np.stack([np.arange(400) // 20, np.full(400, -1)]),
    )
    found = fit_direct([rows], BODY, 100.0, np.full(2, 100.0), np.ones(2, dtype=bool), regression)
    np.testing.assert_allclose(found.coefficients, 0.0, atol=1e-9)
    assert np.all(np.diag(found.covariance) > 0)


def clusters(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Information and scores of a log that knows one sum of parameters to nine digits, others hardly."""
    generator = np.random.default_rng(seed)
    directions = np.linalg.qr(generator.normal(size=(6, 6)))[0]
    known = np.array([1e18, 1e12, 1e6, 1.0, 1e-3, 1e-6]) / count
    return np.stack([(directions * known) @ directions.T] * count), 1e-3 * generator.normal(size=(count, 6))


def test_variances_are_positive_where_the_log_knows_some_parameters_far_better_than_others() -> None:
    for seed in range(20):
        (information, scores), (same, others) = clusters(25, seed), clusters(150, seed)
        covariance = _two_way([information, same], [scores, others]).covariance
        assert np.diag(covariance).min() > 0


SAMPLES, JOINTS, UNKNOWN = 20, 3, 9


def weights(*, acceleration: float = 1.0, force: float = 1.0) -> tuple[Weights, np.ndarray]:
    """Weights of rows that a root's six accelerations and three contact forces disturb, and what these do to them."""
    generator = np.random.default_rng(0)
    effects = generator.normal(size=(SAMPLES, UNKNOWN if force else 6, JOINTS))
    effects[:, 6:] *= force
    effects[:, 6:, 1:] = 0.0  # the forces act on one joint alone
    rows = DirectRows(
        left=np.zeros((SAMPLES, JOINTS)),
        columns=np.zeros((SAMPLES, JOINTS, 1)),
        effects=effects,
        used=np.ones((SAMPLES, JOINTS), dtype=bool),
        kind=np.arange(JOINTS),
        clusters=np.zeros((2, SAMPLES), dtype=np.int64),
    )
    return rows.weights(np.ones((SAMPLES, JOINTS)), np.full(6, acceleration)), effects


def inverse_covariance(of: Weights) -> np.ndarray:
    return of.apply(np.broadcast_to(np.eye(JOINTS), (SAMPLES, JOINTS, JOINTS)))


def test_what_an_acceleration_leaves_of_the_rows_is_exact_where_it_explains_nearly_all_of_them() -> None:
    found, effects = weights(acceleration=3e4, force=0.0)
    expected = np.linalg.inv(np.eye(JOINTS) + 3e4**2 * effects.transpose(0, 2, 1) @ effects)
    np.testing.assert_allclose(inverse_covariance(found), expected, atol=1e-13)  # of a size of 1e-9


def test_the_unit_of_forces_changes_no_weight() -> None:
    one, other = (inverse_covariance(weights(force=force)[0]) for force in (1.0, 1e8))
    np.testing.assert_allclose(one, other, atol=1e-9)
    assert np.abs(one[:, 0]).max() < 1e-9  # nothing is known of the joint that forces act on
    assert np.linalg.eigvalsh(one[:, 1:, 1:]).min() > 0.01
