"""Bodies stay bodies, whatever their coordinates are."""

import numpy as np
import pinocchio as pin
from hypothesis import given, settings
from hypothesis import strategies as st

from stribeck.base.typing import Array
from stribeck.robot.inertial_parameters import pseudo_inertia
from stribeck.settings import Priors
from stribeck.whole_log.model.bodies import bodies_of


def some_parameters(count: int = 4) -> Array:
    """Ellipsoids, turned and off their origins."""
    pin.seed(1)
    sizes = np.random.default_rng(1).uniform(0.1, 0.5, (count, 4))
    return np.stack([pin.SE3.Random().act(pin.Inertia.FromEllipsoid(*size)).toDynamicParameters() for size in sizes])


@settings(deadline=None, max_examples=50)
@given(st.lists(st.floats(-20, 20), min_size=40, max_size=40))
def test_every_coordinate_is_a_body_that_can_exist(coordinates: list[float]) -> None:
    parameters = some_parameters()
    changes = bodies_of(parameters, Priors()).corrections(np.array(coordinates).reshape(4, 10))
    values = np.linalg.eigvalsh(pseudo_inertia(parameters + changes))
    assert np.all(values > -1e-9 * values.max(axis=1, keepdims=True))
    assert np.all(parameters[:, 0] + changes[:, 0] > 0)


def test_derivatives_are_those_of_differences() -> None:
    bodies = bodies_of(some_parameters(), Priors())
    at = 0.7 * np.random.default_rng(2).standard_normal((4, 10))
    slopes = bodies.slopes(at)
    step = 1e-6
    for k in range(10):
        moved = step * np.eye(10)[k]
        difference = (bodies.corrections(at + moved) - bodies.corrections(at - moved)) / (2 * step)
        np.testing.assert_allclose(slopes[:, :, k], difference, atol=1e-8)


def test_coordinates_are_in_units_of_their_prior() -> None:
    parameters = some_parameters(1)
    body = bodies_of(parameters, Priors())
    heavier = body.corrections(np.eye(10)[:1])
    moved = body.corrections(np.eye(10)[1:2])
    np.testing.assert_allclose(heavier[0, 0], parameters[0, 0] * np.expm1(Priors().mass))
    np.testing.assert_allclose(moved[0, 1] / parameters[0, 0], Priors().centre_of_mass)
    np.testing.assert_allclose(moved[0, 0], 0, atol=1e-15)
