"""Many joints are fitted at once as each would be by itself."""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.friction import get_law
from stribeck.settings import Priors
from stribeck.whole_log.model.basis import make_basis
from stribeck.whole_log.model.friction_curves import Curves
from stribeck.whole_log.solver.gauss_newton import minimise
from stribeck.whole_log.solver.joint_descent import descend_joints, joint_costs
from stribeck.whole_log.terms.profile_likelihood import Quadratic

LAW, SPEED = get_law("stribeck"), np.array([1.0, 2.0, 0.5])
CURVES = Curves(LAW, make_basis(LAW, SPEED), SPEED, np.ones(3), Priors())
TRUTH = np.array([[0.3, 1.2, 0.4, 0.2, 0.1, 30.0], [0.5, 0.7, 0.2, 0.3, -0.1, 20.0], [0.1, 2.0, 0.6, 0.1, 0.0, 60.0]])


@pytest.fixture
def logs() -> list[Quadratic]:
    """Quadratics whose least value is near the truth, from many samples of each joint."""
    generator = np.random.default_rng(3)
    found = []
    true = CURVES.coefficients(CURVES.inside(TRUTH)).reshape(3, -1)
    for coefficients in true:
        columns = 30 * generator.standard_normal((400, true.shape[1]))
        torque = columns @ coefficients + generator.standard_normal(400)
        found.append(Quadratic(columns.T @ columns, columns.T @ torque))
    return found


def test_joints_that_are_fitted_together_end_where_each_ends_by_itself(logs: list[Quadratic]) -> None:
    start = CURVES.inside(TRUTH * np.array([1.5, 0.7, 1.5, 0.6, 1.0, 2.0]))
    ends, costs = descend_joints(logs, CURVES, start)
    np.testing.assert_allclose(CURVES.external(ends), TRUTH, atol=0.02, rtol=0.1)
    for joint in range(3):
        end, cost = descend_joints([logs[joint]], CURVES.of([joint]), start[[joint]])
        np.testing.assert_allclose(end[0], ends[joint], rtol=1e-9)
        assert cost[0] == pytest.approx(costs[joint])


def test_no_step_leads_further_down(logs: list[Quadratic]) -> None:
    ends, costs = descend_joints(logs, CURVES, CURVES.inside(TRUTH))
    np.testing.assert_allclose(costs, joint_costs(logs, CURVES).costs(ends))
    low, high = CURVES.bounds
    for change in 1e-2 * np.random.default_rng(4).standard_normal((50, *ends.shape)):
        assert np.all(joint_costs(logs, CURVES).costs(np.clip(ends + change, low, high)) > costs - 1e-2)


@dataclass(frozen=True)
class _Exponential:
    """The costs exp(x) - 3 x, of which a Newton step from far below leads where exp overflows."""

    def of(self, rows: NDArray[np.int64]) -> "_Exponential":  # noqa: ARG002 - there is one descent
        return self

    def costs(self, x: Array) -> Array:
        return np.asarray((np.exp(x) - 3 * x)[:, 0])

    def derivatives(self, x: Array) -> tuple[Array, Array]:
        return np.exp(x) - 3, np.exp(x)[:, :, None]


def test_a_step_that_leads_where_numbers_overflow_is_not_taken() -> None:
    start = np.array([[-10.0]])
    found = minimise(_Exponential(), start, np.full_like(start, -np.inf), np.full_like(start, np.inf))
    assert found.converged.all()
    assert found.x[0, 0] == pytest.approx(np.log(3), abs=0.05)
