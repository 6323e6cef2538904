"""One joint's quadratics say what the whole log would, all else being fitted along."""

import numpy as np
import pytest
from scipy.linalg import block_diag
from tests.identification.whole_log.test_repeated import VALUES, steps

from stribeck.friction import get_law
from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.factors import with_factors
from stribeck.identification.whole_log.joint_descent import descend_joints
from stribeck.identification.whole_log.levels import first_levels
from stribeck.identification.whole_log.model import model_corrections
from stribeck.identification.whole_log.nodes import make_nodes
from stribeck.identification.whole_log.profile import joint_folds
from stribeck.identification.whole_log.solve import solve
from stribeck.identification.whole_log.statistic import Statistic, merged
from stribeck.identification.whole_log.varying import VaryingCurves, rising, varying_curves
from stribeck.weak_equations import Corrections

NOTHING = model_corrections(Corrections(), np.zeros(0))
PLAIN = frozenset({"viscous"})


@pytest.fixture(scope="module")
def parts() -> tuple[VaryingCurves, list[Statistic]]:
    """Curves with viscous friction alone, whose fit is linear, and statistics of four parts of a log."""
    law, speed = get_law("auto"), np.ones(3)
    plain = Curves(law, make_nodes(law, speed), speed, np.ones(3))
    equations = steps(0.0)
    factored = with_factors(equations, equations, rising(plain.nodes), np.zeros((3, plain.nodes.functions.shape[1])))
    curves = varying_curves(plain, factored.nodes, factored.slow)
    curves = curves.only(np.stack([curves.with_terms(PLAIN)] * 3))
    found = []
    for k in range(4):
        found.append(Statistic(curves.nodes, 0))
        for part in factored.equations[k::4]:
            found[-1].add(factored.of(part), first_levels(part, np.zeros(3), np.zeros(3)))
    return curves, found


def test_a_joint_fitted_by_itself_is_what_it_is_in_the_fit_of_all(parts: tuple[VaryingCurves, list[Statistic]]) -> None:
    curves, statistics = parts
    total = merged(statistics)
    solution = solve(total, curves, NOTHING)
    folds = joint_folds(total, statistics[:1], curves, NOTHING, solution)
    without = solve(merged(statistics[1:]), curves, NOTHING, solution)
    for joint, (whole, fold) in enumerate(folds):
        own = curves.of([joint])
        start = np.tile(solution.internal[joint] + 0.05 * curves.free[joint], (2, 1))
        ends, _ = descend_joints([whole.training, fold.training], curves.of([joint, joint]), start)
        np.testing.assert_allclose(ends[0], solution.internal[joint], atol=1e-4)
        np.testing.assert_allclose(ends[1], without.internal[joint], atol=1e-4)
        found = own.external(solution.internal[[joint]])[0, [0, 1, 4]]
        np.testing.assert_allclose(found, VALUES[joint], atol=0.02)


def test_the_held_out_score_is_that_of_the_whole_with_all_else_fitted_again(
    parts: tuple[VaryingCurves, list[Statistic]],
) -> None:
    """One joint has other friction than is best; the other two are fitted to the training part again."""
    curves, statistics = parts
    total, held, training = merged(statistics), statistics[0], merged(statistics[1:])
    solution = solve(total, curves, NOTHING)
    slopes = curves.jacobians(solution.internal)
    for joint, (_, fold) in enumerate(joint_folds(total, [held], curves, NOTHING, solution)):
        others = block_diag(*(slopes[k][:, curves.free[k] * (k != joint)] for k in range(3)))
        scores, direct = [], []
        for coulomb in (1.0, 1.5):
            moved = solution.internal.copy()
            moved[joint, 1] *= coulomb
            coefficients = curves.coefficients(moved)
            step = others.T @ (training.right - training.gram @ coefficients)
            coefficients += others @ np.linalg.solve(others.T @ training.gram @ others, step)
            direct.append(coefficients @ (held.gram @ coefficients - 2 * held.right))
            scores.append(fold.held_out.at(curves.of([joint]).coefficients(moved[[joint]])))
        assert scores[1] - scores[0] == pytest.approx(direct[1] - direct[0], rel=1e-3)
