"""What is believed beforehand is what the log shows: of the model's errors, and of what joints have in common."""

import numpy as np
import pytest
from tests.whole_log.synthetic import make_laws, make_model, no_fit, statistics

from stribeck.core.base.typing import Array
from stribeck.core.estimator.solver.elimination import best_starts, blocks, solve
from stribeck.core.estimator.solver.empirical_bayes import (
    group_mean_covariance,
    learn_group_prior,
    solve_with_empirical_bayes,
)
from stribeck.core.estimator.solver.fit import Fit
from stribeck.core.estimator.solver.statistics import Statistics
from stribeck.core.settings import Priors

JOINTS, SAMPLES, NOISE = 12, 2000, 0.1
ZERO = Priors().encoder_zero
SLOPE, GAIN, SPEED = 40.0, 0.3, 0.15
LAWS = make_laws("stribeck", JOINTS)
OFFSET = 4


def measured(velocity: Array, values: Array, noise: float, seed: int = 0, corrections: int = 0) -> Statistics:
    """Measurements of the friction of all joints, with nothing on the corrections."""
    q = LAWS.basis.functions.shape[1]
    information, right = np.zeros((JOINTS * q + corrections,) * 2), np.zeros(JOINTS * q + corrections)
    design = LAWS.basis.windows(velocity, np.ones(1), 1, len(velocity))
    generator, square = np.random.default_rng(seed), 0.0
    for k in range(JOINTS):
        own, block = design[:, k] / noise, slice(k * q, (k + 1) * q)
        torque = LAWS.law.torque(velocity[:, k], values[k]) / noise + generator.standard_normal(len(velocity))
        information[block, block] = own.T @ own
        right[block] = own.T @ torque
        square += float(torque @ torque)
    return statistics(JOINTS * q, information, right, square, velocity.size)


def moving() -> tuple[Array, Array]:
    """Velocities and the law's parameters: bends that are nearly alike, the rest that is not."""
    generator = np.random.default_rng(2)
    velocity = np.sin(np.linspace(0, 40, SAMPLES)[:, None] * generator.uniform(0.8, 1.2, JOINTS))
    values = np.column_stack(
        [
            generator.uniform(0.1, 0.5, JOINTS),
            generator.uniform(0.3, 1.5, JOINTS),
            GAIN * np.ones(JOINTS),
            SPEED * np.exp(0.05 * generator.standard_normal(JOINTS)),
            generator.uniform(-1, 1, JOINTS),
            SLOPE * np.ones(JOINTS),
        ]
    )
    return velocity, values


def with_zeros(wrong: float, seed: int) -> tuple[Array, Array, Fit]:
    """60 zeros of encoders, what the log shows of them within 0.05 ZERO, and the fit with it."""
    known = measured(*moving(), noise=NOISE, corrections=63)
    generator = np.random.default_rng(seed)
    zeros, error = wrong * ZERO * generator.standard_normal(60), 0.05 * ZERO
    places = known.friction + np.arange(60)
    known.information[places, places] = error**-2
    shown = zeros + error * generator.standard_normal(60)
    known.right[places] = shown / error**2
    return zeros, shown, solve_with_empirical_bayes(known, no_fit(LAWS, make_model(zeros=60, tilts=3)))


@pytest.mark.parametrize("wrong", [0.1, 0.4, 1.0])
def test_the_prior_of_the_model_is_as_wide_as_its_errors(wrong: float) -> None:
    zeros, shown, fit = with_zeros(wrong, seed=1)
    assert fit.model.prior_std[:60] == pytest.approx(wrong, rel=0.25)
    assert fit.model.prior_std[60:] == pytest.approx(1.0)  # what nothing shows is believed as before
    found = fit.model.values(fit.corrections)[:60]
    assert found == pytest.approx(shown, abs=0.1 * ZERO)
    assert np.linalg.norm(found - zeros) < 1.01 * np.linalg.norm(shown - zeros)  # a belief that fits does no harm


def test_the_prior_of_the_model_grows_no_larger_than_at_first() -> None:
    """Else bodies would explain what the law does not."""
    assert with_zeros(3.0, seed=1)[2].model.prior_std == pytest.approx(1.0)


def test_the_prior_of_an_exact_model_is_narrow() -> None:
    shares = []
    for seed in range(3):
        _, shown, fit = with_zeros(0.0, seed)
        shares.append(np.linalg.norm(fit.model.values(fit.corrections)[:60]) / np.linalg.norm(shown))
    assert np.mean(shares) < 0.2  # noise is not taken for errors of the model


def test_scales_that_joints_share_are_found_better_with_a_group_prior() -> None:
    velocity, values = moving()
    errors = []
    for seed in range(4):
        known = measured(velocity, values, noise=3 * NOISE, seed=seed)
        alone = solve(known, best_of(known))
        together = solve_with_empirical_bayes(known, alone)
        assert np.exp(together.laws.group_prior[0, 3]) == pytest.approx(SPEED, rel=0.2)
        assert np.all(np.isnan(together.laws.group_prior[:, [0, 1, OFFSET]]))  # sizes are each joint's own
        errors.append([(LAWS.external(each.internal) / values - 1) ** 2 for each in (alone, together)])
    before, after = np.sqrt(np.mean(errors, axis=(0, 2)))
    assert after[3] < 0.6 * before[3]
    assert after[1] < 0.95 * before[1]


def test_the_variance_over_few_joints_is_right_on_average() -> None:
    laws, found = make_laws("stribeck", 3), []
    for values in np.random.default_rng(0).standard_normal((1000, 3)):
        internal = laws.prior[0].copy()
        internal[:, 3] += values
        learned = learn_group_prior(no_fit(laws, make_model(), internal)).group_prior
        found.append(learned[1, 3] ** 2)
    assert np.mean(found) == pytest.approx(1.0, rel=0.08)


def best_of(known: Statistics) -> Fit:
    """The best of all starts of each joint, where nothing connects the joints."""
    internal, _ = best_starts(LAWS, blocks(known.information, JOINTS), known.right.reshape(JOINTS, -1))
    return no_fit(LAWS, make_model(), internal)


def test_a_joint_without_information_has_the_uncertainty_of_the_group() -> None:
    known = measured(*moving(), noise=0.02 * NOISE)
    own = slice(0, known.friction // JOINTS)
    known.information[own] *= 1e-9
    known.right[own] *= 1e-9
    fit = solve_with_empirical_bayes(known, no_fit(LAWS, make_model()))
    added = np.diag(group_mean_covariance(fit)).reshape(JOINTS, -1)
    prior_std = fit.laws.group_prior[1, 3]
    assert fit.covariance[3, 3] == pytest.approx(prior_std**2, rel=0.01)
    assert added[0, 3] == pytest.approx(prior_std**2 / (JOINTS - 1), rel=0.05)  # that of the others' mean
    assert added[1:, 3].max() < 0.01 * added[0, 3]  # which know their own
