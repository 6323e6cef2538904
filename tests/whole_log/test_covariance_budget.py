"""Each interval says what makes it as wide as it is."""

from pathlib import Path

import numpy as np
import pytest

from stribeck import Robot, identify
from stribeck.log import RobotLog
from stribeck.result import Result, read_result
from stribeck.settings import Settings
from stribeck.whole_log.model.layout import ModelLayout
from stribeck.whole_log.solver.solve import Solution
from stribeck.whole_log.uncertainty.covariance_budget import CovarianceBudget, covariance_budget
from stribeck_simulation.sensors.measure import with_noise

LAYOUT = ModelLayout(joints=2, per_joint=2, zeros=3)


@pytest.fixture
def solution() -> Solution:
    root = np.random.default_rng(1).standard_normal((LAYOUT.size, LAYOUT.size))
    held = np.zeros((2, 2), dtype=bool)
    nothing = {"at_bound": held, "chi_square": 1.0, "cost": 1.0, "converged": True}
    return Solution(layout=LAYOUT, x=np.zeros(LAYOUT.size), covariance=root @ root.T, **nothing)


def budget_of(solution: Solution, overdispersion: float = 1.0) -> CovarianceBudget:
    return covariance_budget(solution, overdispersion, *np.zeros((2, LAYOUT.size, LAYOUT.size)))


def test_noise_is_the_covariance_given_the_model(solution: Solution) -> None:
    budget = budget_of(solution)
    np.testing.assert_allclose(budget.total, solution.covariance)
    friction = LAYOUT.friction
    information = np.linalg.inv(solution.covariance)
    np.testing.assert_allclose(budget.noise[friction, friction], np.linalg.inv(information[friction, friction]))


def test_terms_add_up_and_only_one_of_two_reasons_widens(solution: Solution) -> None:
    own, joint_heterogeneity = np.array([0, 1]), np.array([1.0, 4.0])
    terms = budget_of(solution, overdispersion=3.0).terms(own, 2.0, joint_heterogeneity, np.array([0.1, 0.0]))
    plain = np.diag(budget_of(solution, overdispersion=3.0).total)[:2]
    total = np.diag(np.sum(list(terms.values()), axis=0))
    np.testing.assert_allclose(total, plain * [2.0, 4.0] + [0.01, 0.0])
    assert np.diag(terms["overdispersion"]) == pytest.approx([plain[0], 0.0])
    assert terms["heterogeneity over folds"][0, 0] == pytest.approx(2 * terms["model"][0, 0])
    assert np.diag(terms["common gain"]) == pytest.approx([0.01, 0.0])


def test_shares_are_in_the_result(arm: Robot, exact_arm_log: RobotLog, tmp_path: Path) -> None:
    log = with_noise(exact_arm_log, position=5e-5, torque=0.2, seed=2)
    model = {}
    for corrections in ("none", "inertia"):
        result = identify(log, arm, Settings(law="stribeck", corrections=corrections))
        shares = [found.variance_shares for joint in result.joints.values() for found in joint.parameters.values()]
        for each in shares:
            assert each is not None
            assert sum(each.values()) == pytest.approx(1.0)
        model[corrections] = max(each["model"] for each in shares if each)
        assert _read_again(result, tmp_path).joints == result.joints
    assert model["none"] == 0.0
    assert model["inertia"] > 0.3


def _read_again(result: Result, folder: Path) -> Result:
    path = folder / "result.json"
    path.write_text(result.to_json(), encoding="utf-8")
    return read_result(path)
