"""Bodies stay bodies, slopes are those of differences, columns are the friction terms through the window."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.whole_log.synthetic import make_laws, make_terms, steps

from stribeck.core.base.typing import Array
from stribeck.core.estimator.model.basis import make_basis
from stribeck.core.estimator.model.bodies import bodies_of
from stribeck.core.estimator.model.terms import ERRORS, Columns
from stribeck.core.friction import LAWS, get_law
from stribeck.core.friction.terms.motion import beyond_velocity, signals
from stribeck.core.robot.inertial_parameters import pseudo_inertia
from stribeck.core.settings import Priors


def some_parameters(count: int = 4) -> Array:
    """Ellipsoids, turned and off their origins."""
    pin.seed(1)
    sizes = np.random.default_rng(1).uniform(0.1, 0.5, (count, 4))
    return np.stack([pin.SE3.Random().act(pin.Inertia.FromEllipsoid(*size)).toDynamicParameters() for size in sizes])


@settings(max_examples=50)
@given(st.lists(st.floats(-20, 20), min_size=40, max_size=40))
def test_every_coordinate_is_a_body_that_can_exist(coordinates: list[float]) -> None:
    parameters = some_parameters()
    changes = bodies_of(parameters, Priors()).corrections(np.array(coordinates).reshape(4, 10))
    values = np.linalg.eigvalsh(pseudo_inertia(parameters + changes))
    assert np.all(values > -1e-9 * values.max(axis=1, keepdims=True))
    assert np.all(parameters[:, 0] + changes[:, 0] > 0)


def test_the_prior_of_moments_does_not_depend_on_the_axes() -> None:
    """The logarithm of the moments has the same size in all directions: its norm is that of the coordinates."""
    ball = bodies_of(pin.Inertia.FromSphere(2.0, 0.3).toDynamicParameters()[None], Priors())
    coordinates = np.zeros((1, 10))
    coordinates[0, 4:] = np.random.default_rng(3).standard_normal(6)
    before, after = pseudo_inertia(ball.parameters), pseudo_inertia(ball.parameters + ball.corrections(coordinates))
    sizes = np.log(np.linalg.eigvalsh(after[0, :3, :3]) / before[0, 0, 0])
    assert np.sum(sizes**2) == pytest.approx(2 * Priors().moments ** 2 * np.sum(coordinates**2))


def test_derivatives_are_those_of_differences() -> None:
    bodies = bodies_of(some_parameters(), Priors())
    at = 0.7 * np.random.default_rng(2).standard_normal((4, 10))
    slopes = bodies.slopes(at)
    step = 1e-6
    for k in range(10):
        moved = step * np.eye(10)[k]
        difference = (bodies.corrections(at + moved) - bodies.corrections(at - moved)) / (2 * step)
        np.testing.assert_allclose(slopes[:, :, k], difference, atol=1e-8)


@pytest.mark.parametrize("name", [*LAWS, "auto"])
def test_slopes_of_a_laws_coefficients_are_those_of_differences(name: str) -> None:
    laws = make_laws(name, 2, ERRORS[0].parameters)
    at = laws.prior[0] + 0.3
    slopes, step = laws.jacobians(at), 1e-6
    for k in range(at.shape[1]):
        moved = step * np.eye(at.shape[1])[k]
        difference = (laws.coefficients(at + moved) - laws.coefficients(at - moved)) / (2 * step)
        np.testing.assert_allclose(slopes[:, :, k], difference, atol=1e-6 * max(1, np.abs(difference).max()))
    chosen = laws.of([1, 1, 0]).coefficients(at[[1, 1, 0]])
    np.testing.assert_allclose(chosen, laws.coefficients(at)[[1, 1, 0]], rtol=0, atol=1e-12)  # BLAS rounds by size


def test_starts_are_the_best_linear_fits_of_each_shape_and_the_best_comes_first() -> None:
    laws = make_laws("stribeck", 1, ERRORS[0].parameters)
    truth = np.array([[0.3, 1.2, 0.3, np.log(laws.law.parameters[3].starts[1]), 0.1, np.log(50.0), 0.2, -0.1]])
    q = laws.basis.functions.shape[1] + 2
    information = 1e4 * np.eye(q)
    best, *others = laws.linear_starts(0, information, information @ laws.coefficients(truth)[0])
    miss = [float(np.linalg.norm(laws.coefficients(s[None]) - laws.coefficients(truth))) for s in (best, *others)]
    assert miss == sorted(miss)
    assert miss[0] < 0.1 * miss[-1]
    np.testing.assert_allclose(best[6:], truth[0, 6:], atol=1e-6)


def test_the_basis_represents_every_curve_of_a_law() -> None:
    law, speed = get_law("stribeck"), np.array([0.5, 2.0])
    basis = make_basis(law, speed)
    velocity = np.linspace(-1, 1, 4001)[:, None] * speed
    windows = basis.windows(velocity, np.ones(1), 1, len(velocity))
    for shape in ((0.3, 1.2, 0.3, 0.15, 0.2, 50.0), (0.1, 0.5, 1.0, 0.05, 0.0, 200.0)):
        for joint in range(2):
            values = np.array(shape) * [1 / speed[joint], 1, 1, speed[joint], 1, 1 / speed[joint]]
            theta = basis.functions.T @ law.torque(basis.velocity[joint], values)
            error = windows[:, joint] @ theta - law.torque(velocity[:, joint], values)
            assert np.sqrt(np.mean(error**2)) < 0.01 * np.abs(theta @ basis.functions.T).max()


def test_columns_are_the_friction_terms_through_the_window() -> None:
    """Where load and temperature do not change within a window, they are those of the law "auto"."""
    terms = replace(make_terms(slope=20.0), mean_temperature=np.array([30.0, 31.0, 32.0]))
    part = replace(steps(1)[0], temperature=np.full((40, 3), 35.0))
    load = np.array([2.0, 3.0, 4.0])
    part = replace(part, torque=part.residual + load)
    columns = Columns(make_laws("auto", 3).basis, terms).by_joint(part)[:, :, -terms.size :]
    names = [parameter.name for parameter in terms.parameters]
    generator = np.random.default_rng(1)
    for joint in range(3):
        values = {name: float(generator.normal()) for name in names[: names.index("presliding")]}
        motion = signals(
            part.velocity[:, joint],
            slope=20.0,
            position=part.position[:, joint],
            mean=(0.0, 0.0),
            load=load[joint],
            temperature=5.0 - joint,
            ripple_per_turn=60.0,
        )
        extra = beyond_velocity(values, motion)
        found = columns[:, joint, : len(values)] @ list(values.values())
        np.testing.assert_allclose(found, part.windows(extra[:, None])[:, 0], atol=2e-3 * np.abs(extra).max())
