"""Parts of a log that disagree about the model say that errors last, and by how much less the log is to be believed."""

from dataclasses import replace

import numpy as np
import pytest
from tests.whole_log.test_empirical_bayes import NOISE, SAMPLES, ZERO, friction, moving

from stribeck.base.typing import Array
from stribeck.settings import Priors
from stribeck.whole_log.model.friction_curves import Curves
from stribeck.whole_log.model.model_corrections import ModelCorrections, model_corrections
from stribeck.whole_log.solver.empirical_bayes import solve_with_empirical_bayes
from stribeck.whole_log.solver.normal_equations import NormalEquations, merged
from stribeck.whole_log.solver.solve import Solution, solve
from stribeck.whole_log.uncertainty.covariance_budget import through
from stribeck.whole_log.uncertainty.heterogeneity import heterogeneity, overdispersion_of
from stribeck.whole_log.weak_equations import CorrectionLayout

PARTS, ZEROS, UNSEEN, ERROR = 8, 40, 3, 0.2
OFFSET = 4


def parts_of_a_log(zeros: Array, lasting: float, shared: float, seed: int) -> tuple[list[NormalEquations], Curves]:
    """Return what parts say of friction and of zeros, whose errors are larger than they say by what lasts.

    All parts together are thought to know each zero to `ERROR`, in units of `ZERO`. In the same units, what lasts for
    the length of a part adds an error of standard deviation `lasting` to each part, and `shared` to all of them.
    """
    velocity, values = moving()
    generator = np.random.default_rng(seed)
    of_all = shared * generator.standard_normal(ZEROS)
    found = []
    for k in range(PARTS):
        rows = slice(k * SAMPLES // PARTS, (k + 1) * SAMPLES // PARTS)
        part, curves = friction(velocity[rows], values, NOISE, 100 * seed + k, zeros=ZEROS, tilts=UNSEEN)
        there = np.arange(part.layout.size)[part.layout.part("zeros")]
        errors = np.hypot(np.sqrt(PARTS) * ERROR, lasting) * generator.standard_normal(ZEROS)
        part.information[there, there] = (np.sqrt(PARTS) * ERROR * ZERO) ** -2
        part.right_hand_side[there] = part.information[there, there] * (zeros + ZERO * (errors + of_all))
        found.append(part)
    return found, curves


def fitted(parts: list[NormalEquations], curves: Curves) -> tuple[NormalEquations, Curves, ModelCorrections, Solution]:
    total, model = merged(parts), model_corrections(CorrectionLayout(zeros=ZEROS, tilts=UNSEEN), np.zeros(0), Priors())
    return total, *solve_with_empirical_bayes(total, curves, model, solve(total, curves, model))


@pytest.mark.parametrize("ratio", [1.0, 4.0, 25.0])
def test_heterogeneity_is_the_ratio_of_squared_errors_to_their_covariance(ratio: float) -> None:
    zeros = ZERO * np.random.default_rng(5).standard_normal(ZEROS)
    lasting = np.sqrt((ratio - 1) * PARTS) * ERROR
    parts, curves = parts_of_a_log(zeros, lasting, 0.0, seed=1)
    of_model, of_joints = heterogeneity(parts=parts, **named(fitted(parts, curves)))
    assert of_model == pytest.approx(ratio, rel=0.25)
    assert np.mean(of_joints > 1) < 0.1  # nothing lasts in their friction


def named(found: tuple[NormalEquations, Curves, ModelCorrections, Solution]) -> dict[str, object]:
    return dict(zip(("total", "curves", "model", "solution"), found, strict=True))


def test_a_joint_whose_friction_changes_from_fold_to_fold_is_found() -> None:
    """By as much as errors that last for a part's length make the mean over the parts worse."""
    velocity, values = moving()
    lasting, found, off = 0.05, [], []
    offsets = lasting * np.random.default_rng(4).standard_normal((20, PARTS))
    for seed, changes in enumerate(offsets):
        parts = []
        for k, change in enumerate(changes):
            rows = slice(k * SAMPLES // PARTS, (k + 1) * SAMPLES // PARTS)
            own = values.copy()
            own[0, OFFSET] += change
            part, curves = friction(velocity[rows], own, NOISE, seed=100 * seed + k)
            parts.append(part)
        total, model = merged(parts), model_corrections(CorrectionLayout(), np.zeros(0), Priors())
        curves, model, solution = solve_with_empirical_bayes(total, curves, model, solve(total, curves, model))
        of_model, of_joints = heterogeneity(total, parts, curves, model, solution)
        assert of_model == 1.0
        assert np.mean(of_joints[1:] > 1) < 0.1
        found.append(of_joints[0, OFFSET])
        deviation = np.sqrt(solution.covariance[OFFSET, OFFSET] * of_joints[0, OFFSET])
        off.append((solution.internal[0, OFFSET] - values[0, OFFSET]) / deviation)
    assert min(found) > 2
    assert np.mean(np.abs(off) < 1.96) > 0.8


def test_errors_that_folds_share_are_taken_to_be_as_large_as_those_that_differ() -> None:
    lasting = 2.0 * ERROR * np.sqrt(PARTS)
    before, after = [], []
    for seed in range(4):
        zeros = 0.3 * ZERO * np.random.default_rng(seed).standard_normal(ZEROS)
        parts, curves = parts_of_a_log(zeros, lasting, lasting, seed)
        total, curves, model, solution = fitted(parts, curves)
        overdispersion = overdispersion_of(heterogeneity(total, parts, curves, model, solution)[0], PARTS)
        curves, doubted, wary = solve_with_empirical_bayes(
            total, curves, replace(model, overdispersion=overdispersion), solution
        )
        added = (doubted.overdispersion - 1) * through(wary, wary.layout.nearly_right)
        variance = np.diag(wary.covariance + added)[wary.layout.model]
        assert np.sqrt(variance[ZEROS:]) == pytest.approx(1.0)  # what nothing shows is as unknown as ever
        before.append(solution.corrections[:ZEROS] - zeros / ZERO)
        after.append(wary.corrections[:ZEROS] - zeros / ZERO)
        assert np.mean(np.abs(after[-1]) < 1.96 * np.sqrt(variance[:ZEROS])) > 0.9
    assert np.std(after) < 0.6 * np.std(before)
