"""Ten parameters and the pseudo-inertia are equivalent in every frame."""

import numpy as np
import pinocchio as pin
import pytest

from stribeck.robot.inertial_parameters import carried, inertial_parameters, pseudo_inertia


def some_bodies(count: int = 5) -> list[pin.Inertia]:
    """Make ellipsoids with arbitrary poses."""
    pin.seed(3)
    sizes = np.random.default_rng(3).uniform(0.1, 0.5, (count, 4))
    return [pin.SE3.Random().act(pin.Inertia.FromEllipsoid(*size)) for size in sizes]


def test_there_and_back() -> None:
    parameters = np.stack([body.toDynamicParameters() for body in some_bodies()])
    np.testing.assert_allclose(inertial_parameters(pseudo_inertia(parameters)), parameters, atol=1e-14)


@pytest.mark.parametrize("seed", range(3))
def test_parameters_are_carried_as_pinocchio_carries_the_body(seed: int) -> None:
    pin.seed(seed)
    body, pose = pin.Inertia.Random(), pin.SE3.Random()
    there = carried(pose.homogeneous) @ body.toDynamicParameters()
    np.testing.assert_allclose(there, pose.act(body).toDynamicParameters(), atol=1e-12)
