"""The minimum over bodies that can exist."""

import numpy as np
import pinocchio as pin
import pytest
from tests.test_inertial_parameters import some_bodies

from stribeck.methods.direct.consistent import divergence, minimise
from stribeck.robot.inertial_parameters import carried, inertial_parameters, pseudo_inertia

NOMINAL = np.stack([body.toDynamicParameters() for body in some_bodies(3)])
NONE = np.zeros(0)


def somewhat_off(seed: int = 1) -> np.ndarray:
    """Bodies that can exist, of which every coordinate is drawn out a little."""
    drawn = np.eye(4) + 0.05 * np.random.default_rng(seed).standard_normal((len(NOMINAL), 4, 4))
    return inertial_parameters(drawn @ pseudo_inertia(NOMINAL) @ drawn.transpose(0, 2, 1))


def test_the_divergence_is_the_same_in_every_frame() -> None:
    pin.seed(4)
    there = carried(pin.SE3.Random().homogeneous)
    here = divergence(somewhat_off(), NOMINAL)[0]
    assert divergence(somewhat_off() @ there.T, NOMINAL @ there.T)[0] == pytest.approx(here, rel=1e-9)


def test_derivatives_are_those_of_the_divergence() -> None:
    at = somewhat_off()

    step = 1e-6 * np.random.default_rng(0).standard_normal(at.shape) * np.abs(at)
    (above, slope_above, _), (below, slope_below, _) = (divergence(at + side * step, NOMINAL) for side in (1, -1))
    _, gradient, hessian = divergence(at, NOMINAL)
    assert above - below == pytest.approx(2 * float(np.sum(gradient * step)), rel=1e-5)
    predicted = 2 * np.einsum("lkm,lm->lk", hessian, step)
    np.testing.assert_allclose(slope_above - slope_below, predicted, rtol=1e-4, atol=1e-6 * np.abs(predicted).max())


@pytest.mark.parametrize("certainty", [1.0, 1e4, 1e8])
def test_no_log_asks_for_a_body_that_cannot_exist(certainty: float) -> None:
    """Least squares alone would give the first body a mass below zero."""
    information, right = certainty * np.eye(NOMINAL.size), np.zeros(NOMINAL.size)
    right[0] = -certainty * 2 * NOMINAL[0, 0]
    found = minimise(information, right, NOMINAL, 100.0, NONE, NONE.astype(bool))
    assert np.linalg.eigvalsh(pseudo_inertia(found.parameters)).min() > 0
    assert found.parameters[0, 0] < NOMINAL[0, 0]


def test_friction_that_would_be_negative_is_held_at_zero() -> None:
    information, right = np.eye(32), np.zeros(32)
    right[30:] = -1.0, 2.0
    found = minimise(information, right, NOMINAL, 100.0, np.full(2, 1e-6), np.array([True, True]))
    assert found.held.tolist() == [True, False]
    assert found.coefficients == pytest.approx([0.0, 2.0], abs=1e-4)
    free = minimise(information, right, NOMINAL, 100.0, np.full(2, 1e-6), np.array([False, True]))
    assert free.coefficients == pytest.approx([-1.0, 2.0], abs=1e-4)
