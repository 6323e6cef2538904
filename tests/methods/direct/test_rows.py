"""Weights of rows that unknown accelerations and contact forces disturb (docs/direct.md, 2)."""

import numpy as np

from stribeck.methods.direct.rows import DirectRows, Weights

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
