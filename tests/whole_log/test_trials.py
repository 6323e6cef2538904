"""What a joint's folds say of a term is what fits of all joints would, with the term and without."""

from dataclasses import replace

import numpy as np
import pytest
from tests.whole_log.synthetic import make_laws, make_model, make_terms, no_fit, steps, summed

from stribeck.core.base.typing import Array
from stribeck.core.estimator.model.terms import Columns
from stribeck.core.estimator.solver.elimination import solve
from stribeck.core.estimator.solver.fit import Fit
from stribeck.core.estimator.solver.statistics import Statistics, total
from stribeck.core.estimator.terms.term_selection import _objection, select_terms
from stribeck.core.estimator.terms.trials import make_trials
from stribeck.core.estimator.uncertainty.law_misfit import law_misfits

FOLDS, MU = 4, 0.05
LINEAR = ("viscous", "coulomb", "offset", "load", "coulomb_drift", "viscous_drift")
Log = tuple[Statistics, list[Statistics], Fit]


def log_of(loaded: tuple[int, ...], free: tuple[str, ...]) -> Log:
    """A log in which some joints' friction grows with load, its folds, and the fit with all terms; zeros are wrong."""
    generator, terms, parts = np.random.default_rng(1), make_terms(), []
    for part in steps():
        own = np.abs(part.torque - part.residual)
        more = MU * own * part.windows(np.sign(part.velocity)) * np.isin(np.arange(3), loaded)
        regressors = generator.standard_normal((40, 3, 3))
        residual = part.residual + more + regressors @ (1e-3 * np.arange(3))
        parts.append(
            replace(part, residual=residual, torque=part.torque - part.residual + residual, regressors=regressors)
        )
    laws = make_laws("auto", 3, terms.parameters)
    laws = laws.only(np.tile([p.name in free for p in laws.parameters], (3, 1)))
    folds = summed(parts, Columns(laws.basis, terms), FOLDS, corrections=3)
    whole = total(folds)
    start = np.where(np.isfinite(laws.neutral), laws.neutral, 0.5) * np.ones((3, 1))
    return whole, folds, solve(whole, no_fit(laws, make_model(zeros=3), start))


@pytest.fixture(scope="module")
def linear() -> Log:
    return log_of((1,), LINEAR)


@pytest.mark.parametrize("joint", range(3))
def test_scores_of_linear_terms_are_those_of_refits(linear: Log, joint: int) -> None:
    whole, folds, fit = linear
    trials = make_trials(whole, folds, fit)
    scores, refits = [], []
    for kept in (("viscous",), ("viscous", "load"), ("viscous", "coulomb_drift", "viscous_drift")):
        tried = trials.try_terms(joint, kept)
        scores.append(tried.scores * trials.scale)
        free = fit.laws.free.copy()
        free[joint] &= trials.having(kept)
        start = replace(fit, laws=fit.laws.only(free), internal=np.where(free, fit.internal, fit.laws.neutral))
        again = [solve(whole.without(fold), start) for fold in folds]
        refits.append([fold.chi_square(each.values) for fold, each in zip(folds, again, strict=True)])
        found = solve(whole, start)
        np.testing.assert_allclose(tried.internal, found.internal[joint], atol=1e-3)
    np.testing.assert_allclose(np.diff(scores, axis=0), np.diff(refits, axis=0), rtol=1e-3, atol=0.05)


def test_a_right_law_keeps_its_interval_and_a_wrong_one_widens_it(linear: Log) -> None:
    whole, folds, fit = linear
    trials, basis, errors = make_trials(whole, folds, fit), fit.laws.basis, []
    bump = np.sign(basis.velocity[0]) * np.exp(-((basis.velocity[0] / 0.2) ** 2))
    theta = np.zeros(trials.right.shape[2])
    theta[: basis.functions.shape[1]] = np.linalg.lstsq(basis.functions, bump, rcond=None)[0]
    for size in (0.0, 0.2):  # [N m]; the friction is 0.5 to 1.2 N m
        right = trials.right + trials.information @ (size * theta)
        errors.append(law_misfits(fit, replace(trials, right=right), fit.covariance))
    assert np.max(errors[0]) < 1e-3
    np.testing.assert_allclose(errors[1][:, 0], 0.2 * np.exp(-0.25), rtol=0.4)  # at a tenth of the top speed


def test_terms_are_not_negative(linear: Log) -> None:
    """The friction of the loaded joint, had its load the other sign."""
    whole, folds, fit = linear
    trials = make_trials(whole, folds, fit)
    backwards = replace(trials, right=-trials.right)
    tried = backwards.try_terms(1, ("viscous", "load"))
    at = [trials.names.index(name) for name in ("viscous", "coulomb", "load")]
    assert np.all(tried.internal[at] >= -1e-9)
    assert tried.internal[trials.names.index("load")] == 0.0


@pytest.fixture(scope="module")
def choice() -> tuple[Log, list[set[str]]]:
    free = (*LINEAR, "slope", "stribeck_gain", "stribeck_velocity", "viscous_asymmetry")
    log = log_of((0, 2), free)
    whole, folds, fit = log
    chosen = select_terms(
        make_trials(whole, folds, fit), whole, fit, [{} for _ in range(3)], lambda fit: 0 * fit.covariance
    )
    return log, [set(own) for own in chosen.kept]


def test_each_joint_gets_the_terms_that_it_has(choice: tuple[Log, list[set[str]]]) -> None:
    assert choice[1] == [{"viscous", "load"}, {"viscous"}, {"viscous", "load"}]


def test_terms_that_random_effects_may_explain_are_refused(choice: tuple[Log, list[set[str]]]) -> None:
    whole, folds, fit = choice[0]
    load = [parameter.name for parameter in fit.laws.parameters].index("load")

    def effects(fit: Fit) -> Array:
        added = np.zeros_like(fit.covariance)
        added[load, load] = 1.0  # of the first joint
        return added

    chosen = select_terms(make_trials(whole, folds, fit), whole, fit, [{} for _ in range(3)], effects)
    assert chosen.kept == [{"viscous"}, {"viscous"}, {"viscous", "load"}]
    assert "may be errors that every step repeats" in chosen.verdicts[0]["load"].reason


NEGATIVE = "{} friction would be negative at the beginning of the log or at its end"


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({}, ""),
        ({"viscous_drift": -0.7}, NEGATIVE.format("viscous")),
        ({"viscous_drift": 0.7}, NEGATIVE.format("viscous")),
        ({"coulomb_drift": 3}, NEGATIVE.format("coulomb")),
        ({"coulomb": 0}, "Coulomb friction would be zero without load"),
    ],
)
def test_friction_is_never_negative_or_only_of_the_load(linear: Log, changed: dict[str, float], reason: str) -> None:
    """It would be in a fit that takes friction which grows less than speed, as motion grows, for a drift."""
    trials = make_trials(*linear)
    values = {"viscous": 0.3, "coulomb": 1.2, "viscous_drift": 0.2, "coulomb_drift": 0.5} | changed
    tried = trials.try_terms(0, ("viscous",))
    for name, value in values.items():
        tried.internal[trials.names.index(name)] = value
    objection = _objection(trials, 0, frozenset({"viscous", "load", "viscous_drift", "coulomb_drift"}), tried)
    assert objection == (("refused", reason) if reason else None)
