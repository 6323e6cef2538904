"""The whole-body program: its cone, its terms, and what its solution keeps to."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tests.simulation.walkers import POSTURE, walker

from stribeck.base.typing import Array
from stribeck.robot import Robot
from stribeck_simulation.mujoco.model import Body, compile_body
from stribeck_simulation.robots.sole import Sole
from stribeck_simulation.walking.balance.qp import Task, wrench_cone
from stribeck_simulation.walking.balance.tasks import Gains, base_task, com_task, desired_velocity
from stribeck_simulation.walking.balance.terms import Dynamics
from stribeck_simulation.walking.start import Start, start_standing

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


@cache
def standing_toro() -> tuple[Robot, Body, Dynamics, Start]:
    robot = walker("toro", Path())
    body = compile_body(robot)
    dynamics = Dynamics(robot, body.soles)
    return robot, body, dynamics, start_standing(robot, dynamics, POSTURE["toro"])


@pytest.mark.parametrize("feet", [(1,), (0, 1)])
def test_the_desired_velocity_is_the_tasks_own(feet: tuple[int, ...]) -> None:
    """With the standing foot at rest, it moves the centre of mass, the base and the feet as they are asked to."""
    _, _, dynamics, start = standing_toro()
    nv = dynamics.model.nv
    terms = dynamics.at(start.configuration, np.zeros(nv))
    dcm, turned = terms.com[:2] + np.array([0.01, 0.02]), np.eye(3, nv, 3)
    asked = [
        com_task(terms, dcm, np.zeros(2), terms.com[2] + 0.001, 3.2, Gains()),
        base_task(terms, np.zeros(3), 0.0, 0.3, Gains()),
        *(Task(terms.feet[foot].jacobian, np.zeros(6), np.full(6, 0.1)) for foot in (0, 1) if foot not in feet),
    ]
    standing = [terms.feet[foot] for foot in feet]
    joints = desired_velocity(standing, asked)
    held, moving = standing[0].jacobian[:, :6], standing[0].jacobian[:, 6:]
    velocity = np.concatenate([-np.linalg.solve(held, moving @ joints), joints])
    np.testing.assert_allclose(terms.com_jacobian @ velocity, [0.032, 0.064, 0.01], atol=1e-4)
    np.testing.assert_allclose(turned @ velocity, [0.0, 0.0, 0.3], atol=1e-4)
    for foot, state in enumerate(terms.feet):
        np.testing.assert_allclose(state.jacobian @ velocity, 0.0 if foot in feet else 0.1, atol=1e-4)
