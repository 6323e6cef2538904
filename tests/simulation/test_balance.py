"""The whole-body program: its cone, its terms, and what its solution keeps to."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from qpsolvers import solve_qp
from tests.simulation.walkers import POSTURE, walker

from stribeck.base.typing import Array
from stribeck.robot import Robot
from stribeck_simulation.mujoco.model import Body, compile_body
from stribeck_simulation.robots.sole import Sole
from stribeck_simulation.walking.balance.qp import STANCE_DAMPING, Task, Weights, Wishes, build, solve, wrench_cone
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


@pytest.mark.parametrize("feet", [(1,), (0, 1)])
def test_the_reduced_program_has_the_whole_ones_solution(feet: tuple[int, ...]) -> None:
    """The program of all accelerations and wrenches, with the equation of motion as a constraint, says the same."""
    _, _, dynamics, start = standing_toro()
    generator = np.random.default_rng(6)
    nv, n = dynamics.model.nv, dynamics.model.nv - 6
    configuration, velocity = start.configuration.copy(), 0.2 * generator.normal(size=nv)
    configuration[7:] += 0.05 * generator.normal(size=n)
    terms, cone = dynamics.at(configuration, velocity), wrench_cone(SOLE, 0.6)
    standing = [terms.feet[foot] for foot in feet]
    tasks = [Task(generator.normal(size=(3, nv)), generator.normal(size=3), np.zeros(3)) for _ in range(3)]
    wishes = Wishes(generator.normal(size=n), 300 * generator.random((len(feet), 6)))
    weight = generator.random(9), generator.random(n), 1e-4 * generator.random((len(feet), 6))
    weights = Weights(np.concatenate([weight[0], weight[2][0]]), np.concatenate([weight[1], *weight[2][1:]]))
    limit, watched = np.full(n, 30.0), np.arange(n) % 2 == 0
    program = build(terms, standing, [cone] * len(feet), tasks, wishes, weights)
    torque = solve(program, terms, standing, limit, watched)

    jacobian = np.concatenate([foot.jacobian for foot in standing])
    motion = np.hstack([terms.inertia, -jacobian.T])
    wide = np.concatenate([task.jacobian for task in tasks])
    own = np.concatenate([np.zeros(6), weight[1], weight[2].ravel()])
    P = np.diag(own)
    P[:nv, :nv] += wide.T @ (weight[0][:, None] * wide)
    q = -own * np.concatenate([np.zeros(6), wishes.joints, wishes.wrenches.ravel()])
    q[:nv] -= wide.T @ (weight[0] * np.concatenate([task.wanted for task in tasks]))
    held = np.hstack([jacobian, np.zeros((len(jacobian), len(jacobian)))])
    still = np.concatenate([-foot.drift - STANCE_DAMPING * foot.velocity for foot in standing])
    A, b = np.concatenate([motion[:6], held]), np.concatenate([-terms.bias[:6], still])
    joints, bias, most = motion[6:][watched], terms.bias[6:][watched], limit[watched]
    cones = np.hstack([np.zeros((16 * len(feet), nv)), np.kron(np.eye(len(feet)), cone)])
    G, h = np.concatenate([cones, joints, -joints]), np.concatenate([np.zeros(len(cones)), most - bias, most + bias])
    whole = solve_qp(P, q, G, h, A, b, solver="daqp")
    np.testing.assert_allclose(torque, motion[6:] @ whole + terms.bias[6:], atol=1e-4)
    assert (np.abs(torque[watched]) > 30 - 1e-4).any()
