"""The spread between logs, learned from differences and a prior."""

import numpy as np
import pytest

from stribeck.core.result.log_spread import learn_spread


def test_many_differences_show_the_spread_and_changes_do_not_increase_it() -> None:
    generator = np.random.default_rng(1)
    errors = np.full((300, 4), 0.01)
    differences = np.hypot(0.01, np.sqrt(2) * 0.03) * generator.standard_normal(errors.shape)
    differences[::50] += 0.4
    spread = learn_spread(differences, errors, np.arange(4))
    np.testing.assert_allclose(spread.student()[0], 0.03, rtol=0.15)
    quantile = spread.quantile(0, 0.05, 0.01, 2.0)
    assert spread.tail(0, quantile, 0.01, 2.0) == pytest.approx(0.05)
    assert quantile == pytest.approx(1.96 * np.hypot(0.01, np.sqrt(2) * 0.03), rel=0.15)


def test_a_joint_is_judged_by_the_others_and_a_robot_without_differences_by_public_robots() -> None:
    differences = np.array([[0.001, -0.002, 0.001, 0.002, 0.2]])
    kept = learn_spread(differences, 0 * differences, np.arange(5), others=True)
    assert kept.tail(4, 0.2, 0.0, 2.0) < 1e-3 < kept.tail(0, 0.2, 0.0, 2.0)
    prior = learn_spread(np.zeros((0, 1)), np.zeros((0, 1)), np.zeros(1, dtype=int))
    assert prior.quantile(0, 0.05, 0.0, 2.0) == pytest.approx(0.25, abs=0.01)
