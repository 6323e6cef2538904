"""A joint that a descent has left in a dip of its own gets out of it, and no other moves."""

import numpy as np
import pytest
from tests.identification.whole_log.test_believed import NOISE, elsewhere, friction, moving

from stribeck.identification.whole_log.model import model_corrections
from stribeck.identification.whole_log.restarts import with_restarts
from stribeck.identification.whole_log.solve import solve
from stribeck.weak_equations import Corrections


def test_a_curve_that_lost_its_stribeck_effect_gets_it_back() -> None:
    statistic, curves, model, right, lost = elsewhere(gain=0.0, speed=3.0)
    found = with_restarts(statistic, curves, model, lost)
    assert found.cost == pytest.approx(right.cost)
    assert curves.external(found.internal)[4] == pytest.approx(moving()[1][4], rel=0.2, abs=0.01)
    assert found.internal == pytest.approx(right.internal, abs=1e-3)


def test_where_nothing_is_better_nothing_moves() -> None:
    velocity, values = moving()
    statistic, curves = friction(velocity, values, corrections=0, noise=NOISE)
    model = model_corrections(Corrections(), np.zeros(0))
    right = solve(statistic, curves, model)
    assert with_restarts(statistic, curves, model, right) is right
