"""One joint's quadratics say what the whole log would, all else being fitted along."""

import numpy as np
import pytest
from scipy.linalg import block_diag
from tests.whole_log.test_reml import VALUES, steps

from stribeck.friction import get_law
from stribeck.settings import Priors
from stribeck.whole_log.model.basis import make_basis
from stribeck.whole_log.model.covariates import with_covariates
from stribeck.whole_log.model.friction_curves import Curves
from stribeck.whole_log.model.layout import ModelLayout
from stribeck.whole_log.model.model_corrections import model_corrections
from stribeck.whole_log.model.varying_curves import VaryingCurves, rising, varying_curves
from stribeck.whole_log.noise.variance_components import first_components
from stribeck.whole_log.solver.joint_descent import descend_joints
from stribeck.whole_log.solver.normal_equations import NormalEquations, merged
from stribeck.whole_log.solver.solve import solve
from stribeck.whole_log.terms.profile_likelihood import joint_folds
from stribeck.whole_log.weak_equations import CorrectionLayout

NOTHING = model_corrections(CorrectionLayout(), np.zeros(0), Priors())
PLAIN = frozenset({"viscous"})


@pytest.fixture(scope="module")
def parts() -> tuple[VaryingCurves, list[NormalEquations]]:
    """Curves with viscous friction alone, whose fit is linear, and statistics of four parts of a log."""
    law, speed = get_law("auto"), np.ones(3)
    plain = Curves(law, make_basis(law, speed), speed, np.ones(3), Priors())
    equations = steps(0.0)
    modulated = with_covariates(
        equations,
        equations,
        rising(plain.basis),
        np.zeros((3, plain.basis.functions.shape[1])),
        np.full(3, np.nan),
        np.full(3, np.nan),
        speed,
    )
    curves = varying_curves(plain, modulated.basis, modulated.slow)
    curves = curves.only(np.stack([curves.with_terms(PLAIN)] * 3))
    found = []
    for k in range(4):
        found.append(NormalEquations(curves.basis, ModelLayout(joints=3, per_joint=curves.basis.size // 3)))
        for part in modulated.equations[k::4]:
            found[-1].add(modulated.of(part), first_components(part, np.zeros(3), np.zeros(3)))
    return curves, found


def test_a_joint_fitted_by_itself_is_what_it_is_in_the_fit_of_all(
    parts: tuple[VaryingCurves, list[NormalEquations]],
) -> None:
    curves, by_fold = parts
    total = merged(by_fold)
    solution = solve(total, curves, NOTHING)
    folds = joint_folds(total, by_fold[:1], curves, NOTHING, solution)
    without = solve(merged(by_fold[1:]), curves, NOTHING, solution)
    for joint, (whole, fold) in enumerate(folds):
        own = curves.of([joint])
        start = np.tile(solution.internal[joint] + 0.05 * curves.free[joint], (2, 1))
        ends, _ = descend_joints([whole.training, fold.training], curves.of([joint, joint]), start)
        np.testing.assert_allclose(ends[0], solution.internal[joint], atol=1e-4)
        np.testing.assert_allclose(ends[1], without.internal[joint], atol=1e-4)
        found = own.external(solution.internal[[joint]])[0, [0, 1, 4]]
        np.testing.assert_allclose(found, VALUES[joint], atol=0.02)


def test_the_held_out_score_is_that_of_the_whole_with_all_else_fitted_again(
    parts: tuple[VaryingCurves, list[NormalEquations]],
) -> None:
    """One joint has other friction than is best; the other two are fitted to the training part again."""
    curves, by_fold = parts
    total, held, training = merged(by_fold), by_fold[0], merged(by_fold[1:])
    solution = solve(total, curves, NOTHING)
    slopes = curves.jacobians(solution.internal)
    for joint, (_, fold) in enumerate(joint_folds(total, [held], curves, NOTHING, solution)):
        others = block_diag(*(slopes[k][:, curves.free[k] * (k != joint)] for k in range(3)))
        scores, direct = [], []
        for coulomb in (1.0, 1.5):
            moved = solution.internal.copy()
            moved[joint, 1] *= coulomb
            coefficients = curves.coefficients(moved)
            step = others.T @ (training.right_hand_side - training.information @ coefficients)
            coefficients += others @ np.linalg.solve(others.T @ training.information @ others, step)
            direct.append(coefficients @ (held.information @ coefficients - 2 * held.right_hand_side))
            scores.append(fold.held_out.at(curves.of([joint]).coefficients(moved[[joint]])))
        assert scores[1] - scores[0] == pytest.approx(direct[1] - direct[0], rel=1e-3)
