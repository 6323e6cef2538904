"""The cone of wrenches in the whole-body program."""

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.simulation.robots.sole import Sole
from stribeck.simulation.walking.balance.qp import wrench_cone

SOLE = Sole(half_length=0.1, half_width=0.05)


def corner_wrench(forces: Array) -> Array:
    """Return the wrench of forces at the four corners of the sole, shape (4, 3)."""
    corners = np.array([[0.1, 0.05, 0], [0.1, -0.05, 0], [-0.1, 0.05, 0], [-0.1, -0.05, 0]])
    return np.concatenate([forces.sum(axis=0), np.cross(corners, forces).sum(axis=0)])


def test_the_cone_is_that_of_corner_forces() -> None:
    generator = np.random.default_rng(3)
    cone = wrench_cone(SOLE, 0.6, margin=1.0)
    mu = 0.6 / np.sqrt(2)
    pressing = np.zeros(16)
    for _ in range(2000):
        normal = generator.exponential(100.0, 4) * (generator.random(4) < 0.6)
        tangent = mu * normal[:, None] * generator.choice([-1.0, 1.0], (4, 2))
        slack = cone @ corner_wrench(np.column_stack([tangent, normal]))
        assert slack.max() < 1e-9
        pressing = np.maximum(pressing, slack + 1e-9 >= 0)
    assert pressing.all()  # each face touches what corner forces can give
    for wrench in ([0, 0, -1, 0, 0, 0], [50, 0, 100, 0, 0, 0], [0, 0, 100, 6, 0, 0], [0, 0, 100, 0, 11, 0]):
        assert (cone @ np.array(wrench, dtype=float)).max() > 0
