"""Errors that come back with every step are measured, and widen the intervals of what they can be confused with."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import toeplitz
from tests.whole_log.test_whitening import some_equations

from stribeck.base.typing import Array
from stribeck.friction import get_law
from stribeck.settings import Priors
from stribeck.whole_log.constants import COSINES, REML_ROUNDS, ROOT_EFFECT_FACTOR
from stribeck.whole_log.model.basis import make_basis
from stribeck.whole_log.model.friction_curves import Curves
from stribeck.whole_log.model.layout import ModelLayout
from stribeck.whole_log.model.model_corrections import model_corrections
from stribeck.whole_log.noise.autocorrelation import autocorrelation
from stribeck.whole_log.noise.variance_components import first_components
from stribeck.whole_log.solver.normal_equations import NormalEquations
from stribeck.whole_log.solver.solve import solve
from stribeck.whole_log.uncertainty import reml
from stribeck.whole_log.uncertainty.random_effects import random_effect_columns
from stribeck.whole_log.uncertainty.reml import random_effect_covariance, reml_variances
from stribeck.whole_log.weak_equations import CorrectionLayout, WeakEquations

INERTIA = np.array([[0.5, 0.1, 0.0], [0.1, 0.4, 0.2], [0.0, 0.2, 0.3]])  # of what turns with the root [kg m^2]
VALUES = np.array([[0.3, 1.0, 0.2], [0.2, 0.8, -0.3], [0.1, 0.5, 0.0]])  # viscous, Coulomb, offset


def steps(repeated: float, root_turns: float = 0.0) -> list[WeakEquations]:
    """Steps on two feet: friction, little noise, and errors that come back with every step on the same foot.

    These are torques [N m], and angular accelerations [rad/s^2] that fade as the levels' errors do.
    """
    generator = np.random.default_rng(3)
    torques = repeated * generator.standard_normal((2, 4, 3))
    chords = np.linalg.cholesky(toeplitz(np.append(autocorrelation(3), np.zeros(36))))
    turns = root_turns * chords @ generator.standard_normal((2, 40, 3))
    law = get_law("coulomb-viscous")
    found = []
    for seed in range(30):
        step = replace(some_equations(40, False, seed), gait=seed % 2, encoder_noise=1e-3 * np.ones(4))
        step = replace(step, torque_noise=1e-2 * np.ones(3), root_response=np.zeros((40, 3, 0)))
        time = np.arange(len(step.velocity))[:, None] * np.array([0.05, 0.07, 0.11]) + generator.uniform(0, 6, 3)
        velocity = np.sin(time)
        friction = np.column_stack([law.torque(velocity[:, k], VALUES[k]) for k in range(3)])
        windows = np.stack([friction[3 * k : 3 * k + 7].T @ step.taps for k in range(40)])
        noise = 0.005 * generator.standard_normal((40, 3))
        torque = random_effect_columns(step) @ torques[seed % 2].ravel()
        step = replace(step, velocity=velocity, residual=windows + noise + torque.reshape(40, 3))
        if root_turns:
            response = np.tile(INERTIA, (40, 1, 1))
            step = replace(step, root_response=np.concatenate([np.zeros((40, 3, 3)), response], axis=2))
            step = replace(step, residual=step.residual + turns[seed % 2] @ INERTIA.T)
        found.append(step)
    return found


def fitted(equations: list[WeakEquations], root_turns: float = 0.0) -> tuple[Array, Array, Array]:
    """Return repeated levels, errors and standard errors of the friction."""
    law = get_law("coulomb-viscous")
    basis = make_basis(law, np.ones(3))
    curves = Curves(law, basis, np.ones(3), np.ones(3), Priors())
    model = model_corrections(CorrectionLayout(), np.zeros(0), Priors())
    turns = np.full(equations[0].root_response.shape[2] // 2, root_turns)
    effects = COSINES * (3 + len(turns))
    layout = ModelLayout(joints=3, per_joint=basis.size // 3, gaits=2, gait_effects=effects)
    normal_equations = NormalEquations(basis, layout)
    for part in equations:
        normal_equations.add(part, first_components(part, np.zeros(3), np.zeros(3)))
    solution = solve(normal_equations.without("gaits"), curves, model)
    components, added = random_effect_covariance(
        normal_equations, normal_equations.count, curves, model, solution, turns
    )
    return components, (solution.internal - VALUES).ravel(), np.sqrt(np.diag(solution.covariance + added))[:9]


def test_variances_are_estimated_and_intervals_cover_the_true_value() -> None:
    components, errors, deviations = fitted(steps(0.05))
    assert np.all((components > 0.025) & (components < 0.1))
    assert np.mean(np.abs(errors) < 2 * deviations) > 0.85
    _, _, without = fitted(steps(0.0))
    offsets = slice(2, None, 3)
    assert np.all(deviations[offsets] > 5 * without[offsets])


def test_rocking_widens_the_intervals() -> None:
    equations = steps(0.0, root_turns=0.05)
    components, errors, deviations = fitted(equations, root_turns=0.05)
    _, _, without = fitted(equations)
    assert components[3:] == pytest.approx(ROOT_EFFECT_FACTOR * 0.05)
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


def test_chance_alone_finds_none_in_many_joints() -> None:
    generator = np.random.default_rng(6)
    joints, each = 24, 12
    found = []
    for _ in range(100):
        pull = generator.standard_normal(joints * each)
        found.append(reml_variances(np.eye(joints * each), pull, joints))
    error = np.sqrt(2 / each)  # of one joint by itself, that would find 0.4 of it on average
    assert np.mean(found) < 0.2 * error
    assert np.quantile(found, 0.9) < 0.5 * error


def test_a_joint_that_stands_out_from_many_keeps_its_variance_in_every_round(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    generator = np.random.default_rng(9)
    joints, each = 21, 16
    effects = np.tile(np.append(np.zeros(joints - 1), 3.0), each) * generator.standard_normal(joints * each)
    pull = 4 * effects + 2 * generator.standard_normal(joints * each)
    found = []
    for rounds in (REML_ROUNDS, REML_ROUNDS + 1, 10 * REML_ROUNDS):
        monkeypatch.setattr(reml, "REML_ROUNDS", rounds)
        found.append(reml_variances(4 * np.eye(joints * each), pull, joints))
    assert 4 < found[0][-1] < 18
    assert found[0][:-1].max() < 0.05 * found[0][-1]
    assert np.sqrt(found[1]) == pytest.approx(np.sqrt(found[0]), rel=0.02, abs=0.02)
    assert np.sqrt(found[2]) == pytest.approx(np.sqrt(found[0]), rel=0.02, abs=0.02)


def test_a_joint_that_shows_nothing_disturbs_no_other() -> None:
    generator = np.random.default_rng(8)
    joints, each = 3, 16
    seen = np.tile([1.0, 0.0, 1.0], each)
    pull = 2 * seen * generator.standard_normal(joints * each)
    blind = reml_variances(np.diag(seen), pull, joints)
    both = [0, 2]
    without = reml_variances(np.eye(2 * each), pull.reshape(each, joints)[:, both].ravel(), 2)
    assert blind[both] == pytest.approx(without, rel=1e-6)
