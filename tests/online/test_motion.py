"""Single samples have the momentum, its change and the observable joints of batches."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from tests.models import example_robot

from stribeck.contact.mode import ContactMode
from stribeck.dynamics.momentum import momentum_balance
from stribeck.dynamics.rooted import rooted_inverse_dynamics
from stribeck.dynamics.state import Orientation, State
from stribeck.online.motion import Tree

MODES = {
    "panda": (),
    "talos": ("left",),
    "g1": ("right", "left"),
    "go2": ("FL", "RR"),
    "cassie": ("left",),
}


@pytest.mark.parametrize("name", MODES)
def test_a_sample_has_the_momentum_of_a_batch(name: str) -> None:
    robot, feet = example_robot(name), MODES[name]
    generator = np.random.default_rng(0)
    position, velocity = generator.normal(size=(2, 1, len(robot.joint_names)))
    turn = generator.normal(size=(1, 4))
    turn /= np.linalg.norm(turn)
    omega = generator.normal(size=(1, 3))
    mode = ContactMode(robot, feet, feet[0] if feet else "")
    orientation = Orientation(turn, omega, np.zeros((1, 3))) if feet else None
    rooted, root = mode.rooted, mode.root(State(position, velocity, 0 * velocity, orientation))
    expected = momentum_balance(rooted, position, velocity, root)
    tree = Tree(mode)
    found = tree.momentum(position[0], velocity[0], (turn[0], omega[0]) if feet else (None, None))
    for own, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(own, other[0], rtol=1e-6, atol=1e-6 * np.abs(other).max())


def test_a_payload_is_the_difference_of_two_models() -> None:
    robot = example_robot("talos")
    mode = ContactMode(robot, ("left",), "left")
    position = np.random.default_rng(0).normal(size=(1, len(robot.joint_names)))
    still, turn = np.zeros_like(position), np.array([[0.1, -0.2, 0.3, 0.9]])
    turn /= np.linalg.norm(turn)
    state = State(position, still, still, Orientation(turn, *np.zeros((2, 1, 3))))
    rooted, root = mode.rooted, mode.root(state)
    joint, pose = rooted.bodies[1]
    model = rooted.model.copy()
    model.appendBodyToJoint(joint, pin.Inertia(1.0, robot.tree.model.inertias[1].lever, np.zeros((3, 3))), pose)
    light, heavy = (
        rooted_inverse_dynamics(tree, position, still, still, root)[1][0]
        for tree in (rooted, replace(rooted, model=model))
    )
    found = Tree(mode).payload(position[0], (turn[0], None))
    np.testing.assert_allclose(found, heavy - light, atol=1e-9 * np.abs(heavy).max())
