"""Inverses of curvatures that a log and a prior of very different sizes make."""

import numpy as np

from stribeck.whole_log.solver.solve import inverse_of


def test_where_rounding_leaves_nothing_of_a_prior_variances_are_those_of_rounding() -> None:
    """Two parameters whose sum alone a log shows, a third one, and a prior that is lost beside the log's share."""
    together = np.array([1.0, 1.0, 0.0])
    curvature = 1e5 * np.outer(together, together) + np.diag([1e-14, 1e-14, 4.0])
    found = inverse_of(curvature)
    assert min(found[0, 0], found[1, 1]) > 1e8
    np.testing.assert_allclose(found[:2, :2] / found[0, 0], [[1.0, -1.0], [-1.0, 1.0]], rtol=1e-6)
    np.testing.assert_allclose(found[2], [0.0, 0.0, 0.25], atol=1e-6)
