"""What is believed beforehand is what the log shows: of the model's errors, and of what joints have in common."""

import numpy as np
import pytest

from stribeck.base.typing import Array
from stribeck.friction import get_law
from stribeck.settings import Priors
from stribeck.whole_log.model.basis import make_basis
from stribeck.whole_log.model.friction_curves import Curves
from stribeck.whole_log.model.layout import ModelLayout
from stribeck.whole_log.model.model_corrections import ModelCorrections, model_corrections
from stribeck.whole_log.solver.empirical_bayes import group_mean_covariance, solve_with_empirical_bayes
from stribeck.whole_log.solver.normal_equations import NormalEquations
from stribeck.whole_log.solver.solve import Solution, solve
from stribeck.whole_log.weak_equations import CorrectionLayout

JOINTS, SAMPLES, NOISE = 12, 2000, 0.1
ZERO = Priors().encoder_zero
SLOPE, GAIN, SPEED = 40.0, 0.3, 0.15


def friction(
    velocity: Array, values: Array, noise: float, seed: int = 0, **corrections: int
) -> tuple[NormalEquations, Curves]:
    """Return what measurements of the friction of all joints say, with nothing on the corrections."""
    law = get_law("stribeck")
    ones = np.ones(JOINTS)
    curves = Curves(law, make_basis(law, ones), ones, ones, Priors())
    size = curves.basis.functions.shape[1]
    normal_equations = NormalEquations(curves.basis, ModelLayout(joints=JOINTS, per_joint=size, **corrections))
    design = curves.basis.windows(velocity, np.ones(1), 1, len(velocity))
    generator = np.random.default_rng(seed)
    for k in range(JOINTS):
        own, block = design[:, k] / noise, slice(k * size, (k + 1) * size)
        torque = law.torque(velocity[:, k], values[k]) / noise + generator.standard_normal(len(velocity))
        normal_equations.information[block, block] = own.T @ own
        normal_equations.right_hand_side[block] = own.T @ torque
        normal_equations.square += float(torque @ torque)
    normal_equations.count = velocity.size
    return normal_equations, curves


def moving() -> tuple[Array, Array]:
    """Return velocities and the law's parameters: bends that are nearly alike, the rest that is not."""
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


def with_zeros(wrong: float, seed: int) -> tuple[Array, Array, tuple[Curves, ModelCorrections, Solution]]:
    """Return 60 zeros of encoders, what the log shows of them within 0.05 ZERO, and what is believed with it."""
    normal_equations, curves = friction(*moving(), noise=NOISE, zeros=60, tilts=3)
    generator = np.random.default_rng(seed)
    zeros, error = wrong * ZERO * generator.standard_normal(60), 0.05 * ZERO
    known = np.arange(normal_equations.layout.size)[normal_equations.layout.part("zeros")]
    normal_equations.information[known, known] = error**-2
    measured = zeros + error * generator.standard_normal(60)
    normal_equations.right_hand_side[known] = normal_equations.information[known, known] * measured
    model = model_corrections(CorrectionLayout(zeros=60, tilts=3), np.zeros(0), Priors())
    start = solve(normal_equations, curves, model)
    return zeros, measured, solve_with_empirical_bayes(normal_equations, curves, model, start)


@pytest.mark.parametrize("wrong", [0.1, 0.4, 1.0])
def test_the_prior_of_the_model_is_as_wide_as_its_errors(wrong: float) -> None:
    zeros, measured, (_, believed, solution) = with_zeros(wrong, seed=1)
    assert believed.prior_std[:60] == pytest.approx(wrong, rel=0.25)
    assert believed.prior_std[60:] == pytest.approx(1.0)  # what nothing shows is believed as before
    found = believed.values(solution.corrections)[:60]
    assert found == pytest.approx(measured, abs=0.1 * ZERO)
    assert np.linalg.norm(found - zeros) < 1.01 * np.linalg.norm(measured - zeros)  # a belief that fits does no harm


def test_the_prior_of_an_exact_model_is_narrow() -> None:
    shares = []
    for seed in range(3):
        _, measured, (_, believed, solution) = with_zeros(0.0, seed)
        shares.append(np.linalg.norm(believed.values(solution.corrections)[:60]) / np.linalg.norm(measured))
    assert np.mean(shares) < 0.2  # noise is not taken for errors of the model


def test_scales_that_joints_share_are_found_better_with_a_group_prior() -> None:
    velocity, values = moving()
    model = model_corrections(CorrectionLayout(), np.zeros(0), Priors())
    errors = []
    for seed in range(4):
        normal_equations, curves = friction(velocity, values, noise=3 * NOISE, seed=seed)
        alone = solve(normal_equations, curves, model)
        together, _, solution = solve_with_empirical_bayes(normal_equations, curves, model, alone)
        assert together.group_prior is not None
        assert np.exp(together.group_prior[0, 3]) == pytest.approx(SPEED, rel=0.2)
        assert np.all(np.isnan(together.group_prior[:, [0, 1, 4]]))  # sizes of friction are each joint's own
        errors.append([(curves.external(each.internal) / values - 1) ** 2 for each in (alone, solution)])
    before, after = np.sqrt(np.mean(errors, axis=(0, 2)))
    assert after[3] < 0.6 * before[3]
    assert after[1] < 0.95 * before[1]


def test_the_group_prior_of_joints_that_differ_is_wide() -> None:
    velocity, values = moving()
    values[:, 3] = np.geomspace(0.05, 0.4, JOINTS)
    normal_equations, curves = friction(velocity, values, noise=0.02 * NOISE)
    model = model_corrections(CorrectionLayout(), np.zeros(0), Priors())
    _, _, solution = solve_with_empirical_bayes(normal_equations, curves, model, solve(normal_equations, curves, model))
    assert curves.external(solution.internal)[:, 3] == pytest.approx(values[:, 3], rel=0.03)


def test_a_joint_without_information_has_the_uncertainty_of_the_group() -> None:
    velocity, values = moving()
    normal_equations, curves = friction(velocity, values, noise=0.02 * NOISE)
    own = slice(0, normal_equations.basis.size // JOINTS)
    normal_equations.information[own] *= 1e-9
    normal_equations.right_hand_side[own] *= 1e-9
    model = model_corrections(CorrectionLayout(), np.zeros(0), Priors())
    curves, _, solution = solve_with_empirical_bayes(
        normal_equations, curves, model, solve(normal_equations, curves, model)
    )
    added = np.diag(group_mean_covariance(curves, solution)).reshape(JOINTS, -1)
    assert curves.group_prior is not None
    prior_std = curves.group_prior[1, 3]
    assert solution.covariance[3, 3] == pytest.approx(prior_std**2, rel=0.01)
    assert added[0, 3] == pytest.approx(prior_std**2 / (JOINTS - 1), rel=0.05)  # that of the others' mean
    assert added[1:, 3].max() < 0.01 * added[0, 3]  # which know their own
