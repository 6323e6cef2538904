"""A joint that a descent has left in a local minimum gets out of it, and no other moves."""

from dataclasses import replace

import numpy as np
import pytest
from tests.whole_log.test_empirical_bayes import NOISE, friction, moving

from stribeck.settings import Priors
from stribeck.whole_log.model.model_corrections import model_corrections
from stribeck.whole_log.solver.multistart import with_other_starts
from stribeck.whole_log.solver.solve import solve
from stribeck.whole_log.weak_equations import CorrectionLayout


def test_a_curve_that_lost_its_stribeck_effect_gets_it_back() -> None:
    normal_equations, curves = friction(*moving(), noise=0.3 * NOISE)
    model = model_corrections(CorrectionLayout(), np.zeros(0), Priors())
    best = solve(normal_equations, curves, model)
    x = best.x.copy()
    x[best.layout.friction].reshape(best.internal.shape)[4, 2:4] = 0.0, np.log(3.0)
    found = with_other_starts(normal_equations, curves, model, replace(best, x=x, cost=np.inf))
    assert found.cost == pytest.approx(best.cost)
    assert curves.external(found.internal)[4] == pytest.approx(moving()[1][4], rel=0.2, abs=0.01)
    assert found.internal == pytest.approx(best.internal, abs=5e-3)
