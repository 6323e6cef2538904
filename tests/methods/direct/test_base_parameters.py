"""Base parameters are as many as the textbooks count."""

import numpy as np
import pinocchio as pin
import pytest

from stribeck.base.typing import Array
from stribeck.methods.direct.consistent import base_parameters


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


@pytest.mark.parametrize(
    ("model", "count"),
    [
        (serial("y"), 3),
        (serial("yy"), 6),  # in a vertical plane: ZZ, MX, MY of both links, with what the first carries of the second
        (serial("zz"), 4),  # in a horizontal one gravity shows no first moments of the first link
        (serial("zyz"), 15),
        (serial("zyzyzyz"), 43),  # as of the Franka Panda (Gaz et al. 2019)
        (serial("zyyxyx"), 36),  # as of the PUMA 560 (Gautier and Khalil 1990)
    ],
    ids=["pendulum", "planar", "planar, level", "wrist", "seven joints", "six joints"],
)
def test_a_serial_arm_has_as_many_as_mayeda_counts(model: pin.Model, count: int) -> None:
    """7 n - 4 b - 2 of n joints, the first b of them parallel, without the -2 where gravity crosses the first axis."""
    columns, _ = base_parameters(regressor(model))
    assert len(columns) == count
    assert np.linalg.matrix_rank(regressor(model), tol=1e-7) == count


def test_the_columns_are_independent_and_all_others_follow_from_them() -> None:
    matrix = regressor(serial("zyz"))
    columns, condition = base_parameters(matrix)
    rest = matrix - matrix[:, columns] @ np.linalg.lstsq(matrix[:, columns], matrix, rcond=None)[0]
    assert np.abs(rest).max() < 1e-10 * np.abs(matrix).max()
    assert 1 < condition < 1e3
