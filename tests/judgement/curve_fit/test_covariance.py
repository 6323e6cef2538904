"""Covariance: the jackknife it stands for, and honesty where nothing is known."""

import json

import numpy as np
import pytest

from stribeck.core.friction import get_law
from stribeck.core.judgement.curve_fit.problem import joint_problem
from stribeck.core.judgement.joint_fit import intervals_95
from stribeck.core.judgement.weakness import is_weak
from stribeck.core.settings import Settings
from stribeck.paper.curve_fit.covariance import block_covariance
from stribeck.paper.curve_fit.fit import fit_joint

WIDE = 1e3


def linear_problem(blocks: int = 12, size: int = 40, seed: int = 0):
    rng = np.random.default_rng(seed)
    block = np.repeat(np.arange(blocks), size)
    jacobian = np.column_stack([rng.normal(size=len(block)), np.ones(len(block))])
    response = jacobian @ [2.0, -1.0] + rng.normal(size=blocks)[block] + rng.normal(size=len(block))
    return jacobian, response, block


def test_linear_covariance_is_the_block_jackknife() -> None:
    jacobian, response, block = linear_problem()
    estimate = np.linalg.lstsq(jacobian, response)[0]
    changes = [np.linalg.lstsq(jacobian[block != b], response[block != b])[0] - estimate for b in range(12)]
    expected = 11 / 12 * sum(np.outer(change, change) for change in changes)
    found = block_covariance(jacobian, response - jacobian @ estimate, block, np.full(2, WIDE))
    np.testing.assert_allclose(found.covariance, expected, rtol=1e-4, atol=1e-9)


def test_parameters_that_only_show_together_are_unknown_apart() -> None:
    jacobian, response, block = linear_problem()
    jacobian = np.column_stack([jacobian, jacobian[:, 0]])
    covariance = block_covariance(jacobian, response, block, np.full(3, WIDE)).covariance
    assert np.sqrt(covariance[0, 0]) == pytest.approx(WIDE / np.sqrt(2), rel=1e-3)
    assert covariance[0, 0] + covariance[2, 2] + 2 * covariance[0, 2] < 1e-3 * WIDE**2


def test_degrees_of_freedom_count_the_blocks_that_know() -> None:
    jacobian, response, block = linear_problem()
    jacobian[block > 1, 0] = 0  # two blocks alone know the first parameter
    freedom = block_covariance(jacobian, response, block, np.full(2, WIDE)).degrees_of_freedom
    assert freedom[0] == pytest.approx(1.0, abs=0.1)
    assert freedom[1] == pytest.approx(11.0, abs=1.5)


def test_logarithmic_intervals_are_symmetric_in_the_logarithm() -> None:
    low, high = intervals_95(np.array([0.2]), np.array([0.5]), np.array([1e6]), np.array([True]))[0]
    assert low * high == pytest.approx(0.04)
    assert np.log(high / 0.2) == pytest.approx(1.96 * 0.5, rel=1e-3)


ZERO = {"no stribeck": ["stribeck_gain"], "no coulomb": ["coulomb"], "nothing": ["viscous", "coulomb", "offset"]}
ZERO["slow"] = []
"""Parameters that are zero, by what is meaningless."""


@pytest.mark.parametrize("noise", [0.0, 1e-9, 0.3])
@pytest.mark.parametrize("kind", ZERO)
def test_meaningless_parameters_get_huge_finite_intervals(make_samples, make_joint, truth, kind, noise) -> None:
    truth = truth | dict.fromkeys(ZERO[kind], 0.0)
    joint = make_joint(truth=truth, speed=0.003 if kind == "slow" else 1.5, noise=noise)
    samples = make_samples({"knee": joint}, blocks=12)
    problem = joint_problem(samples, "knee", get_law("stribeck"), Settings())
    fit = fit_joint(problem)
    numbers = [fit.values, fit.standard_errors, fit.covariance, fit.intervals, fit.degrees_of_freedom, fit.rms]
    json.dumps([np.asarray(number).tolist() for number in numbers], allow_nan=False)
    for parameter, value in zip(fit.parameters, fit.values, strict=True):
        assert parameter.lower <= value <= parameter.upper
    if kind != "slow" or noise > 0.01:
        assert is_weak(fit, problem.velocity)[3]
