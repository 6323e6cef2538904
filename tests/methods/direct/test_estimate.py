"""Direct least squares: weights, covariance, base parameters, and bodies that are physically possible."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from tests.robot.test_kinematics import some_bodies

from stribeck.core.base.typing import Array
from stribeck.core.robot.inertial_parameters import carried, inertial_parameters, pseudo_inertia
from stribeck.paper.direct.consistent import base_parameters, divergence, minimise
from stribeck.paper.direct.estimate import Regression, _two_way, fit_direct
from stribeck.paper.direct.rows import DirectRows, Weights

BODY = np.array([[2.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.1, 0.0, 0.0, 0.1]])
"""Mass, first moments and inertia."""


def rows_of(columns: Array, effects: Array) -> DirectRows:
    """Make rows without torques: columns have shape (T, n, p), effects of unknown accelerations (T, k, n)."""
    samples, joints, _ = columns.shape
    return DirectRows(
        left=np.zeros((samples, joints)),
        columns=columns,
        effects=effects,
        used=np.ones((samples, joints), dtype=bool),
        kind=np.arange(joints),
        clusters=np.zeros((2, samples), dtype=np.int64),
    )


@pytest.mark.parametrize("regression", ["ordinary", "weighted", "robust"])
def test_torques_that_are_the_models_to_the_last_digit_have_no_friction(regression: Regression) -> None:
    generator = np.random.default_rng(0)
    velocity = generator.normal(size=400)
    columns = np.column_stack([generator.normal(size=(400, 10)), velocity, np.sign(velocity)])
    rows = rows_of(columns[:, None], np.zeros((400, 0, 1)))
    rows = replace(rows, clusters=np.stack([np.arange(400) // 20, np.full(400, -1)]))
    found = fit_direct([rows], BODY, 100.0, np.full(2, 100.0), np.ones(2, dtype=bool), regression)
    np.testing.assert_allclose(found.coefficients, 0.0, atol=1e-9)
    assert np.all(np.diag(found.covariance) > 0)


def clusters(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Information and scores of a log that knows one sum of parameters to nine digits, others hardly."""
    generator = np.random.default_rng(seed)
    directions = np.linalg.qr(generator.normal(size=(6, 6)))[0]
    known = np.array([1e18, 1e12, 1e6, 1.0, 1e-3, 1e-6]) / count
    return np.stack([(directions * known) @ directions.T] * count), 1e-3 * generator.normal(size=(count, 6))


def test_variances_are_positive_where_the_log_knows_some_parameters_far_better_than_others() -> None:
    for seed in range(20):
        (information, scores), (same, others) = clusters(25, seed), clusters(150, seed)
        covariance = _two_way([information, same], [scores, others]).covariance
        assert np.diag(covariance).min() > 0


SAMPLES, JOINTS, UNKNOWN = 20, 3, 9


def weights(*, acceleration: float = 1.0, force: float = 1.0) -> tuple[Weights, np.ndarray]:
    """Weights of rows that a root's six accelerations and three contact forces disturb, and what these do to them."""
    generator = np.random.default_rng(0)
    effects = generator.normal(size=(SAMPLES, UNKNOWN if force else 6, JOINTS))
    effects[:, 6:] *= force
    effects[:, 6:, 1:] = 0.0  # the forces act on one joint alone
    rows = rows_of(np.zeros((SAMPLES, JOINTS, 1)), effects)
    return rows.weights(np.ones((SAMPLES, JOINTS)), np.full(6, acceleration)), effects


def inverse_covariance(of: Weights) -> np.ndarray:
    return of.apply(np.broadcast_to(np.eye(JOINTS), (SAMPLES, JOINTS, JOINTS)))


def test_what_an_acceleration_leaves_of_the_rows_is_exact_where_it_explains_nearly_all_of_them() -> None:
    found, effects = weights(acceleration=3e4, force=0.0)
    expected = np.linalg.inv(np.eye(JOINTS) + 3e4**2 * effects.transpose(0, 2, 1) @ effects)
    np.testing.assert_allclose(inverse_covariance(found), expected, atol=1e-13)  # of a size of 1e-9


def test_the_unit_of_forces_changes_no_weight() -> None:
    one, other = (inverse_covariance(weights(force=force)[0]) for force in (1.0, 1e8))
    np.testing.assert_allclose(one, other, atol=1e-9)
    assert np.abs(one[:, 0]).max() < 1e-9  # nothing is known of the joint that forces act on
    assert np.linalg.eigvalsh(one[:, 1:, 1:]).min() > 0.01


def serial(axes: str, gravity: str = "z") -> pin.Model:
    """Return a serial arm of revolute joints about these axes, with any bodies, under gravity along an axis."""
    pin.seed(0)
    model = pin.Model()
    model.gravity.linear = -9.81 * np.eye(3)["xyz".index(gravity)]
    for k, axis in enumerate(axes):
        where = pin.SE3(np.eye(3), np.zeros(3) if k == 0 else np.array([0.3, 0.1, 0.2]))
        joint = model.addJoint(k, getattr(pin, f"JointModelR{axis.upper()}")(), where, f"joint_{k}")
        model.appendBodyToJoint(joint, pin.Inertia.Random(), pin.SE3.Identity())
    return model


def regressor(model: pin.Model, samples: int = 60) -> Array:
    generator, data = np.random.default_rng(1), model.createData()
    states = generator.standard_normal((samples, 3, model.nv))
    return np.vstack([pin.computeJointTorqueRegressor(model, data, *state) for state in states])


COUNTS = {"y": 3, "zyz": 15}
COUNTS["yy"] = 6  # in a vertical plane: ZZ, MX, MY of both links, with what the first carries of the second
COUNTS["zz"] = 4  # in a horizontal one gravity shows no first moments of the first link
COUNTS["zyzyzyz"] = 43  # as of the Franka Panda (Gaz et al. 2019)
COUNTS["zyyxyx"] = 36  # as of the PUMA 560 (Gautier and Khalil 1990)


@pytest.mark.parametrize(("axes", "count"), COUNTS.items())
def test_a_serial_arm_has_as_many_as_mayeda_counts(axes: str, count: int) -> None:
    """7 n - 4 b - 2 of n joints, the first b of them parallel, without the -2 where gravity crosses the first axis."""
    model = serial(axes)
    columns, _ = base_parameters(regressor(model))
    assert len(columns) == count
    assert np.linalg.matrix_rank(regressor(model), tol=1e-7) == count


def test_the_columns_are_independent_and_all_others_follow_from_them() -> None:
    matrix = regressor(serial("zyz"))
    columns, condition = base_parameters(matrix)
    rest = matrix - matrix[:, columns] @ np.linalg.lstsq(matrix[:, columns], matrix, rcond=None)[0]
    assert np.abs(rest).max() < 1e-10 * np.abs(matrix).max()
    assert 1 < condition < 1e3


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
