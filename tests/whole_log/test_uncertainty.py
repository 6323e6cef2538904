"""Intervals contain what makes them wide: noise, the model, errors that last, errors that every step repeats."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import toeplitz
from tests.whole_log.synthetic import VALUES, NoTerms, make_laws, make_model, no_fit, steps, summed
from tests.whole_log.test_empirical_bayes import LAWS, NOISE, OFFSET, SAMPLES, ZERO, measured, moving

from stribeck.core.base.typing import Array
from stribeck.core.equations.constants import COSINES, ROOT_EFFECT_FACTOR
from stribeck.core.equations.weak_equations import WeakEquations, autocorrelation
from stribeck.core.estimator.fit_checks.validation import friction_residual_rms
from stribeck.core.estimator.model.terms import Columns
from stribeck.core.estimator.noise.variance_components import first_components
from stribeck.core.estimator.solver.elimination import solve
from stribeck.core.estimator.solver.empirical_bayes import solve_with_empirical_bayes
from stribeck.core.estimator.solver.fit import Fit
from stribeck.core.estimator.solver.statistics import Statistics, total
from stribeck.core.estimator.uncertainty.covariance_budget import CovarianceBudget, covariance_budget, through
from stribeck.core.estimator.uncertainty.heterogeneity import Heterogeneity, heterogeneity, overdispersion_of
from stribeck.core.estimator.uncertainty.reml import random_effect_covariance, reml_variances

PARTS, ZEROS, UNSEEN, ERROR = 8, 40, 3, 0.2
INERTIA = np.array([[0.5, 0.1, 0.0], [0.1, 0.4, 0.2], [0.0, 0.2, 0.3]])  # of what turns with the root [kg m^2]


def budget(overdispersion: float = 1.0) -> tuple[Fit, CovarianceBudget]:
    """Of two joints with two parameters, and three zeros of encoders."""
    laws, model = make_laws("coulomb-viscous", 2), replace(make_model(zeros=3), overdispersion=overdispersion)
    fit = no_fit(laws, model)
    root = np.random.default_rng(1).standard_normal((len(fit.x), len(fit.x)))
    fit, none = replace(fit, covariance=root @ root.T), np.zeros_like(root)
    return fit, covariance_budget(fit, none, none, Heterogeneity(1.0, np.ones(2)), 1.0)


def test_friction_that_is_off_leaves_its_error_as_the_residual() -> None:
    laws, off = make_laws("coulomb-viscous", 3), np.array([0.02, 0.1, 0.4])
    columns, (part, *_) = Columns(laws.basis, NoTerms()), steps(1)
    values, wrong = (laws.coefficients(VALUES + np.outer(change, [0, 0, 1])).ravel() for change in (0 * off, off))
    exact = columns.design(part, columns.by_joint(part)) @ values
    components = first_components(part, np.zeros(3), np.zeros(3))
    read: Any = SimpleNamespace(columns=columns, pilot=SimpleNamespace(components=components))
    part = replace(part, residual=exact.reshape(part.residual.shape))
    np.testing.assert_allclose(friction_residual_rms(read, [part], values, wrong[None])[0], off, rtol=0.02)


def test_noise_is_the_covariance_given_the_model() -> None:
    fit, found = budget()
    np.testing.assert_allclose(found.total, fit.covariance)
    friction = slice(fit.internal.size)
    information = np.linalg.inv(fit.covariance)
    np.testing.assert_allclose(found.noise[friction, friction], np.linalg.inv(information[friction, friction]))


def parts_of_a_log(zeros: Array, lasting: float, shared: float, seed: int) -> list[Statistics]:
    """What parts say of friction and of zeros, whose errors are larger than they say by what lasts.

    All parts together are thought to know each zero to `ERROR`, in units of `ZERO`. In the same units, what lasts for
    the length of a part adds an error of standard deviation `lasting` to each part, and `shared` to all of them.
    """
    velocity, values = moving()
    generator = np.random.default_rng(seed)
    of_all = shared * generator.standard_normal(ZEROS)
    found = []
    for k in range(PARTS):
        rows = slice(k * SAMPLES // PARTS, (k + 1) * SAMPLES // PARTS)
        part = measured(velocity[rows], values, NOISE, 100 * seed + k, ZEROS + UNSEEN)
        there = part.friction + np.arange(ZEROS)
        errors = np.hypot(np.sqrt(PARTS) * ERROR, lasting) * generator.standard_normal(ZEROS)
        part.information[there, there] = (np.sqrt(PARTS) * ERROR * ZERO) ** -2
        part.right[there] = part.information[there, there] * (zeros + ZERO * (errors + of_all))
        found.append(part)
    return found


def fitted(parts: list[Statistics]) -> tuple[Statistics, Fit]:
    whole = total(parts)
    return whole, solve_with_empirical_bayes(whole, no_fit(LAWS, make_model(zeros=ZEROS, tilts=UNSEEN)))


@pytest.mark.parametrize("ratio", [1.0, 4.0, 25.0])
def test_heterogeneity_is_the_ratio_of_squared_errors_to_their_covariance(ratio: float) -> None:
    zeros = ZERO * np.random.default_rng(5).standard_normal(ZEROS)
    parts = parts_of_a_log(zeros, np.sqrt((ratio - 1) * PARTS) * ERROR, 0.0, seed=1)
    whole, fit = fitted(parts)
    found = heterogeneity(whole, parts, fit)
    assert found.model == pytest.approx(ratio, rel=0.25)
    np.testing.assert_allclose(found.joints, 1.0, atol=0.3)  # nothing lasts in their friction


def test_the_covariance_of_folds_is_that_of_the_fit_if_nothing_differs() -> None:
    """But for the prior, which is as large as one of 25 parts of the information; without F / (F - 1), it were 0.83."""
    shares = []
    for seed in range(20):
        whole, fit = fitted(
            parts := parts_of_a_log(ZERO * np.random.default_rng(seed).standard_normal(ZEROS), 0, 0, seed)
        )
        folds = heterogeneity(whole, parts, fit).covariance
        shares.append(np.mean((np.diag(folds) / np.diag(fit.covariance))[-UNSEEN - ZEROS :][:ZEROS]))
    assert np.mean(shares) == pytest.approx(0.96, abs=0.05)


def test_a_joint_whose_friction_changes_from_fold_to_fold_is_found() -> None:
    """By as much as errors that last for a part's length make the mean over the parts worse."""
    velocity, values = moving()
    found, off, start = [], [], no_fit(LAWS, make_model())
    for seed, changes in enumerate(0.05 * np.random.default_rng(4).standard_normal((20, PARTS))):
        parts = []
        for k, change in enumerate(changes):
            own = values.copy()
            own[0, OFFSET] += change
            rows = slice(k * SAMPLES // PARTS, (k + 1) * SAMPLES // PARTS)
            parts.append(measured(velocity[rows], own, NOISE, seed=100 * seed + k))
        whole = total(parts)
        start = fit = solve_with_empirical_bayes(whole, start)
        differing = heterogeneity(whole, parts, fit)
        assert differing.model == 1.0
        none = np.zeros_like(fit.covariance)
        variance = np.diag(covariance_budget(fit, none, none, differing, 1.0).total)
        assert differing.joints[0] > differing.joints[1:].max()
        found.append(differing.joints[0])
        deviation = np.sqrt(variance[OFFSET])
        off.append((fit.internal[0, OFFSET] - values[0, OFFSET]) / deviation)
    assert min(found) > 2
    assert np.mean(np.abs(off) < 1.96) > 0.8


def test_errors_that_folds_share_are_taken_to_be_half_as_large_as_those_that_differ() -> None:
    lasting = 2.0 * ERROR * np.sqrt(PARTS)
    before, after = [], []
    for seed in range(4):
        zeros = 0.3 * ZERO * np.random.default_rng(seed).standard_normal(ZEROS)
        parts = parts_of_a_log(zeros, lasting, lasting / 2, seed)
        whole, fit = fitted(parts)
        overdispersion = overdispersion_of(heterogeneity(whole, parts, fit).model, PARTS)
        wary = solve_with_empirical_bayes(whole, replace(fit, model=replace(fit.model, overdispersion=overdispersion)))
        added = (wary.model.overdispersion - 1) * through(wary, wary.layout.places("bodies", "base_delay"))
        variance = np.diag(wary.covariance + added)[wary.internal.size :]
        assert np.sqrt(variance[ZEROS:]) == pytest.approx(1.0)  # what nothing shows is as unknown as ever
        before.append(fit.corrections[:ZEROS] - zeros / ZERO)
        after.append(wary.corrections[:ZEROS] - zeros / ZERO)
        assert np.mean(np.abs(after[-1]) < 1.96 * np.sqrt(variance[:ZEROS])) > 0.9
    assert np.std(after) < 0.6 * np.std(before)


def test_overdispersion_is_the_variance_of_a_mean_over_folds_with_shared_errors() -> None:
    folds, ratio, generator = 2, 3.0, np.random.default_rng(0)
    differing = np.sqrt(ratio) * generator.standard_normal((20_000, folds))
    shared = 0.5 * np.sqrt(ratio - 1) * generator.standard_normal((20_000, 1))
    mean = np.sqrt(folds) * (differing + shared).mean(axis=1)  # in units of its standard error without any
    assert overdispersion_of(ratio, folds) == pytest.approx(mean.var(), rel=0.05)


def repeating(torque: float, root_turns: float = 0.0) -> list[WeakEquations]:
    """Steps with errors that come back with every step on the same foot.

    These are torques [N m], and angular accelerations [rad/s^2] that fade as the levels' errors do.
    """
    generator = np.random.default_rng(3)
    torques = torque * generator.standard_normal((2, COSINES * 3))
    chords = np.linalg.cholesky(toeplitz(np.append(autocorrelation(3), np.zeros(36))))
    turns = root_turns * chords @ generator.standard_normal((2, 40, 3))
    found = []
    for part in steps():
        more = (part.gait_phase_effects() @ torques[part.gait]).reshape(40, 3)
        if root_turns:
            response = np.concatenate([np.zeros((40, 3, 3)), np.tile(INERTIA, (40, 1, 1))], axis=2)
            part, more = replace(part, root_response=response), more + turns[part.gait] @ INERTIA.T
        found.append(replace(part, residual=part.residual + more))
    return found


def test_repeated_errors_of_all_shapes_have_the_same_size_over_a_step() -> None:
    middle = (np.arange(40) + 0.5) / 40
    part = replace(steps()[0], since=middle, until=1 - middle, root_response=np.ones((40, 3, 6)))
    sizes = (part.gait_phase_effects().reshape(40, 3, COSINES, -1)[..., -3:] ** 2).sum(axis=(0, 1, 3))
    np.testing.assert_allclose(sizes, sizes[0])


def with_effects(equations: list[WeakEquations], root_turns: Array) -> tuple[Array, Array, Array]:
    """Return standard deviations of random effects, and errors and standard errors of the friction."""
    laws = make_laws("coulomb-viscous", 3)
    (known,) = summed(equations, Columns(laws.basis, NoTerms()), 1)
    fit = solve(known, no_fit(laws, make_model()))
    effect_std, added = random_effect_covariance(known, known.count, fit, root_turns)
    return effect_std, (fit.internal - VALUES).ravel(), np.sqrt(np.diag(fit.covariance + added))


def test_repeated_torques_are_measured_and_widen_the_intervals() -> None:
    effect_std, errors, deviations = with_effects(repeating(0.05), np.zeros(0))
    assert np.all((effect_std > 0.025) & (effect_std < 0.1))
    assert np.mean(np.abs(errors) < 2 * deviations) > 0.85
    _, _, without = with_effects(repeating(0.0), np.zeros(0))
    assert np.all(deviations[2::3] > 5 * without[2::3])  # of offsets


def test_rocking_widens_the_intervals() -> None:
    equations = repeating(0.0, root_turns=0.05)
    effect_std, errors, deviations = with_effects(equations, np.full(3, 0.05))
    _, _, without = with_effects(equations, np.zeros(3))
    assert effect_std[3:] == pytest.approx(ROOT_EFFECT_FACTOR * 0.05)
    assert np.all(deviations > without)
    assert np.all(np.abs(errors) < 2 * deviations)


def test_variances_are_right_on_average_and_none_where_there_are_none() -> None:
    generator = np.random.default_rng(5)
    joints, each, true = 3, 16, np.array([0.0, 0.25, 4.0])
    root = generator.standard_normal((joints * each, joints * each)) / 4 + np.eye(joints * each)
    information = root.T @ root
    found = []
    for _ in range(300):
        effects = np.tile(np.sqrt(true), each) * generator.standard_normal(joints * each)
        pull = information @ effects + root.T @ generator.standard_normal(joints * each)
        found.append(reml_variances(information, pull, joints))
    assert np.mean(found, axis=0) == pytest.approx(true, rel=0.15, abs=0.1)
    assert np.median(found, axis=0)[0] < 0.03


def test_a_joint_that_stands_out_keeps_its_variance_and_one_that_shows_nothing_disturbs_no_other() -> None:
    generator = np.random.default_rng(9)
    joints, each = 21, 16
    effects = np.tile(np.append(np.zeros(joints - 1), 3.0), each) * generator.standard_normal(joints * each)
    pull = 4 * effects + 2 * generator.standard_normal(joints * each)
    found = reml_variances(4 * np.eye(joints * each), pull, joints)
    assert 4 < found[-1] < 18
    assert found[:-1].max() < 0.05 * found[-1]
    seen = np.tile([1.0, 0.0, 1.0], each)
    pull = 2 * seen * np.random.default_rng(8).standard_normal(3 * each)
    blind = reml_variances(np.diag(seen), pull, 3)
    both = [0, 2]
    without = reml_variances(np.eye(2 * each), pull.reshape(each, 3)[:, both].ravel(), 2)
    assert blind[both] == pytest.approx(without, rel=1e-6)


def test_variances_of_joints_that_differ_by_chance_are_pooled() -> None:
    joints, each, generator = 20, 16, np.random.default_rng(3)
    information = np.eye(joints * each)
    found = [reml_variances(information, pull, joints) for pull in generator.standard_normal((40, joints * each))]
    assert np.mean(np.ptp(found, axis=1) > 1e-9) < 0.6
