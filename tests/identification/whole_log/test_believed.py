"""What is believed beforehand is what the log shows: of the model's errors, and of what joints have in common."""

from dataclasses import replace

import numpy as np
import pytest

from stribeck.friction import get_law
from stribeck.identification.whole_log.believed import by_what_is_common, solve_and_believe
from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.model import ZERO, ModelCorrections, model_corrections
from stribeck.identification.whole_log.nodes import make_nodes
from stribeck.identification.whole_log.solve import Solution, solve
from stribeck.identification.whole_log.statistic import Statistic
from stribeck.typing import Array
from stribeck.weak_equations import Corrections

JOINTS, SAMPLES, NOISE = 12, 2000, 0.1
SLOPE, GAIN, SPEED = 40.0, 0.3, 0.15


def friction(velocity: Array, values: Array, corrections: int, noise: float, seed: int = 0) -> tuple[Statistic, Curves]:
    """Return what measurements of the friction of all joints say, with nothing on the corrections."""
    law = get_law("stribeck")
    ones = np.ones(JOINTS)
    curves = Curves(law, make_nodes(law, ones), ones, ones)
    statistic = Statistic(curves.nodes, corrections)
    size = curves.nodes.functions.shape[1]
    design = curves.nodes.windows(velocity, np.ones(1), 1, len(velocity))
    generator = np.random.default_rng(seed)
    for k in range(JOINTS):
        own, block = design[:, k] / noise, slice(k * size, (k + 1) * size)
        torque = law.torque(velocity[:, k], values[k]) / noise + generator.standard_normal(len(velocity))
        statistic.gram[block, block] = own.T @ own
        statistic.right[block] = own.T @ torque
        statistic.square += float(torque @ torque)
    statistic.count = velocity.size
    return statistic, curves


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


def elsewhere(gain: float, speed: float) -> tuple[Statistic, Curves, ModelCorrections, Solution, Solution]:
    """Return a log, what is fitted to it, the best solution, and one whose joint 4 has another gain and velocity."""
    statistic, curves = friction(*moving(), corrections=0, noise=0.3 * NOISE)
    model = model_corrections(Corrections(), np.zeros(0))
    right = solve(statistic, curves, model)
    lost = right.internal.copy()
    lost[4, 2:4] = gain, np.log(speed)
    return statistic, curves, model, right, replace(right, internal=lost, cost=np.inf)


def with_zeros(wrong: float, seed: int) -> tuple[Array, Array, tuple[Curves, ModelCorrections, Solution]]:
    """Return 60 zeros of encoders, what the log shows of them within 0.05 ZERO, and what is believed with it."""
    statistic, curves = friction(*moving(), corrections=60 + 3, noise=NOISE)
    generator = np.random.default_rng(seed)
    zeros, error = wrong * ZERO * generator.standard_normal(60), 0.05 * ZERO
    first = statistic.nodes.size
    known = np.arange(first, first + 60)
    statistic.gram[known, known] = error**-2
    measured = zeros + error * generator.standard_normal(60)
    statistic.right[known] = statistic.gram[known, known] * measured
    model = model_corrections(Corrections(zeros=60, tilts=3), np.zeros(0))
    start = solve(statistic, curves, model)
    return zeros, measured, solve_and_believe(statistic, curves, model, start)


@pytest.mark.parametrize("wrong", [0.1, 0.4, 1.0])
def test_how_wrong_the_model_is_believed_to_be_is_what_the_log_shows(wrong: float) -> None:
    zeros, measured, (_, believed, solution) = with_zeros(wrong, seed=1)
    assert believed.spread[:60] == pytest.approx(wrong, rel=0.25)
    assert believed.spread[60:] == pytest.approx(1.0)  # what nothing shows is believed as before
    found = believed.values(solution.corrections)[0][:60]
    assert found == pytest.approx(measured, abs=0.1 * ZERO)
    assert np.linalg.norm(found - zeros) < 1.01 * np.linalg.norm(measured - zeros)  # a belief that fits does no harm


def test_what_is_right_is_believed_to_be_right() -> None:
    shares = []
    for seed in range(3):
        _, measured, (_, believed, solution) = with_zeros(0.0, seed)
        shares.append(np.linalg.norm(believed.values(solution.corrections)[0][:60]) / np.linalg.norm(measured))
    assert np.mean(shares) < 0.2  # noise is not taken for errors of the model


def test_bends_of_curves_that_are_alike_are_found_better_together() -> None:
    velocity, values = moving()
    model = model_corrections(Corrections(), np.zeros(0))
    errors = []
    for seed in range(4):
        statistic, curves = friction(velocity, values, corrections=0, noise=3 * NOISE, seed=seed)
        alone = solve(statistic, curves, model)
        together, _, solution = solve_and_believe(statistic, curves, model, alone)
        assert together.alike is not None
        assert np.exp(together.alike[0, 3]) == pytest.approx(SPEED, rel=0.2)
        assert np.all(np.isnan(together.alike[:, [0, 1, 4]]))  # sizes of friction are each joint's own
        errors.append([(curves.external(each.internal) / values - 1) ** 2 for each in (alone, solution)])
    before, after = np.sqrt(np.mean(errors, axis=(0, 2)))
    assert after[3] < 0.6 * before[3]
    assert after[1] < 0.95 * before[1]


def test_joints_that_differ_are_left_different() -> None:
    velocity, values = moving()
    values[:, 3] = np.geomspace(0.05, 0.4, JOINTS)
    statistic, curves = friction(velocity, values, corrections=0, noise=0.02 * NOISE)
    model = model_corrections(Corrections(), np.zeros(0))
    _, _, solution = solve_and_believe(statistic, curves, model, solve(statistic, curves, model))
    assert curves.external(solution.internal)[:, 3] == pytest.approx(values[:, 3], rel=0.03)


def test_a_joint_in_another_dip_comes_back_to_those_it_is_like() -> None:
    statistic, curves, model, _, lost = elsewhere(gain=1.0, speed=3.0)
    true = moving()[1][4]
    assert curves.external(solve(statistic, curves, model, lost).internal)[4, 3] > 10 * true[3]
    _, _, solution = solve_and_believe(statistic, curves, model, lost)
    assert curves.external(solution.internal)[4] == pytest.approx(true, rel=0.1)


def test_a_joint_that_shows_next_to_nothing_is_as_uncertain_as_one_more_of_its_kind() -> None:
    velocity, values = moving()
    statistic, curves = friction(velocity, values, corrections=0, noise=0.02 * NOISE)
    own = slice(0, statistic.nodes.size // JOINTS)
    statistic.gram[own] *= 1e-9
    statistic.right[own] *= 1e-9
    model = model_corrections(Corrections(), np.zeros(0))
    curves, _, solution = solve_and_believe(statistic, curves, model, solve(statistic, curves, model))
    added = np.diag(by_what_is_common(curves, solution)).reshape(JOINTS, -1)
    assert curves.alike is not None
    spread = curves.alike[1, 3]
    assert solution.covariance[3, 3] == pytest.approx(spread**2, rel=0.01)
    assert added[0, 3] == pytest.approx(spread**2 / (JOINTS - 1), rel=0.05)  # that of the others' mean
    assert added[1:, 3].max() < 0.01 * added[0, 3]  # which know their own
