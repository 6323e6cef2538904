"""The whole-body program: its cone, its terms, and what its solution keeps to."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from qpsolvers import solve_qp
from tests.models import make_robot
from tests.simulation.walkers import POSTURE, walker

from stribeck.base.typing import Array
from stribeck.errors import SettingsError
from stribeck.robot import Robot
from stribeck_simulation.mujoco.model import Body, compile_body
from stribeck_simulation.robots import MODELS
from stribeck_simulation.robots.sole import Sole
from stribeck_simulation.walking.balance.controller import WalkingController
from stribeck_simulation.walking.balance.qp import STANCE_DAMPING, Task, Weights, Wishes, build, solve, wrench_cone
from stribeck_simulation.walking.balance.swing import PRESS, swing_at
from stribeck_simulation.walking.balance.tasks import Gains, base_task, com_task, desired_velocity
from stribeck_simulation.walking.balance.terms import Dynamics
from stribeck_simulation.walking.footsteps import Footprint, Steps
from stribeck_simulation.walking.plan import plan_walk
from stribeck_simulation.walking.start import Start, start_standing

SOLE = Sole((0.0, 0.0, 0.0), 0.1, 0.05)


def corner_wrench(forces: Array) -> Array:
    """Return the wrench of forces at the four corners of the sole, shape (4, 3)."""
    corners = np.array([[0.1, 0.05, 0], [0.1, -0.05, 0], [-0.1, 0.05, 0], [-0.1, -0.05, 0]])
    return np.concatenate([forces.sum(axis=0), np.cross(corners, forces).sum(axis=0)])


def test_the_cone_holds_all_that_corner_forces_can_give_and_no_more() -> None:
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


def test_the_swing_starts_and_lands_at_rest_and_its_derivatives_are_its_own() -> None:
    start, goal = np.array([0.1, 0.2, 0.01]), Footprint(0.5, 0.25, 0.3)
    at = [swing_at(start, 0.1, goal, 0.05, s, 0.8) for s in np.linspace(0, 1, 8001)]
    place = np.array([swing.place for swing in at])
    np.testing.assert_allclose(place[[0, -1]], [start, [0.5, 0.25, -PRESS]], atol=1e-12)
    assert place[:, 2].max() == pytest.approx(0.055, abs=1e-3)
    assert at[-1].yaw == pytest.approx(0.3)
    for value, slope in (("place", "velocity"), ("velocity", "acceleration")):
        exact = np.array([getattr(swing, slope) for swing in at])
        numeric = np.gradient(np.array([getattr(swing, value) for swing in at]), 1e-4, axis=0)
        np.testing.assert_allclose(numeric[1:-1], exact[1:-1], atol=0.02)
        np.testing.assert_allclose(exact[[0, -1]], 0.0, atol=1e-12)


def test_the_watched_limits_give_the_whole_programs_solution() -> None:
    """Torques are those of a controller that always watches every joint."""
    robot, body, dynamics, start = standing_toro()
    plan = plan_walk([Steps(count=2, forward=0.2)], start.feet, 3.2)
    limit = np.minimum(body.torque_limit, 40.0)  # knees need more than that
    quick, whole = (WalkingController(robot, dynamics, body.soles, start, limit, plan, Gains()) for _ in range(2))
    generator = np.random.default_rng(5)
    cut = 0
    for sample in range(0, plan.samples, 250):
        configuration = start.configuration.copy()
        configuration[7:] += 0.02 * generator.normal(size=len(limit))
        velocity = 0.05 * generator.normal(size=dynamics.model.nv)
        whole._torque = limit.copy()  # as if all had been at their limits
        torque = quick.torque(sample, configuration, velocity)
        np.testing.assert_allclose(torque, whole.torque(sample, configuration, velocity), atol=1e-4)
        cut += bool(np.any(np.abs(torque) > limit - 1e-6))
    assert cut > 2


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
    assert whole is not None
    assert torque is not None
    np.testing.assert_allclose(torque, motion[6:] @ whole + terms.bias[6:], atol=1e-4)
    assert (np.abs(torque[watched]) > 30 - 1e-4).any()


def test_a_robot_on_point_feet_is_refused() -> None:
    robot = make_robot(
        MODELS / "toro.xml", {}, {name: {"frame": f"{name}_sole", "kind": "point"} for name in ("left", "right")}
    )
    dynamics = Dynamics(robot, dict.fromkeys(robot.contacts, SOLE))
    with pytest.raises(SettingsError, match="two contacts of kind 'surface'; found point, point"):
        start_standing(robot, dynamics, {})
