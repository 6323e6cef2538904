"""Clusters of two kinds (docs/direct.md, 5): their covariances are added, and the prior's share counts once."""

import numpy as np

from stribeck.methods.direct.estimate import _two_way


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
