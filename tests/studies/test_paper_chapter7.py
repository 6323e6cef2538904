"""What the studies of chapter 7 change in a model, and how they measure a curve."""

import numpy as np
import pinocchio as pin
import pytest
from studies.paper.inexact import body_names, displaced, drawn, scaled, with_bodies
from studies.paper.swing import feeding, split

from stribeck import Robot
from stribeck_simulation.robots.toro import ROBOT_FILE

pin.seed(1)
RANDOM = [pin.Inertia.Random() for _ in range(5)]


@pytest.mark.parametrize("inertia", RANDOM)
def test_scaling_all_eigenvalues_scales_the_matrix(inertia) -> None:
    np.testing.assert_allclose(scaled(1.3, 1.3)(inertia).matrix(), 1.3 * inertia.matrix(), atol=1e-12)


@pytest.mark.parametrize("inertia", RANDOM)
def test_changes_of_mass_and_of_moments_add_up(inertia) -> None:
    whole, mass, moments = (
        change(inertia).matrix() for change in (scaled(1.2, 1.2), scaled(mass=1.2), scaled(moments=1.2))
    )
    np.testing.assert_allclose(mass + moments - inertia.matrix(), whole, atol=1e-12)


def test_only_the_bodies_named_are_changed_and_the_robot_itself_is_not() -> None:
    robot = Robot.from_file(ROBOT_FILE)
    before = [np.array(inertia.matrix()) for inertia in robot.tree.model.inertias]
    offset = np.array([0.01, 0.0, -0.02])
    wrong = with_bodies(robot, displaced(offset), ("right_knee",))
    for name, old, now in zip(body_names(robot), before[1:], list(wrong.tree.model.inertias)[1:], strict=True):
        assert np.allclose(old, now.matrix()) == (name != "right_knee")
    k = 1 + body_names(robot).index("right_knee")
    np.testing.assert_allclose(wrong.tree.model.inertias[k].lever - robot.tree.model.inertias[k].lever, offset)
    for old, kept in zip(before, robot.tree.model.inertias, strict=True):
        np.testing.assert_array_equal(old, kept.matrix())


def test_drawn_errors_stay_within_their_limits_and_follow_from_the_seed() -> None:
    robot = Robot.from_file(ROBOT_FILE)
    once, again, other = (with_bodies(robot, drawn(seed)).tree.model.inertias for seed in (1, 1, 2))
    masses = np.array([[each.mass for each in bodies][1:] for bodies in (once, robot.tree.model.inertias)])
    ratios = masses[0] / masses[1]
    assert 0.95 < ratios.min() < 1 < ratios.max() < 1.05
    assert [each.mass for each in once] == [each.mass for each in again]
    assert [each.mass for each in once] != [each.mass for each in other]


def test_split_is_the_distance_of_branches_and_zero_without_them() -> None:
    phase = np.linspace(0, 2 * np.pi, 4000)
    velocity, acceleration = np.sin(phase), np.cos(phase)
    assert split(velocity, acceleration, 3.0 + 0.2 * np.sign(acceleration)) == pytest.approx(0.4)
    assert split(velocity, acceleration, 3.0 + np.tanh(5 * velocity)) < 0.01
    rising = acceleration > 0
    assert np.isnan(split(velocity[rising], acceleration[rising], velocity[rising]))


def test_friction_that_resists_feeds_nothing_in() -> None:
    velocity = np.linspace(-1, 1, 1001)
    assert feeding(velocity, np.tanh(40 * velocity)) == 0.0
    assert feeding(velocity, -velocity) == pytest.approx(1.0, abs=0.05)
    assert feeding(velocity, np.sign(velocity) + 2.0) == pytest.approx(0.5, abs=0.01)
