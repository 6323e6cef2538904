"""The friction torque by the paper's dense equations, which the re-rooted recursion is checked and timed against."""

import numpy as np

from stribeck.dynamics.constrained import constrained_sample
from stribeck.dynamics.state import State
from stribeck.robot import Robot
from stribeck.typing import Array


def dense_friction_torque(robot: Robot, feet: tuple[str, ...], state: State, torque: Array) -> tuple[Array, Array]:
    """Return the friction torque (5.13) of the torque-controlled joints and the wrenches on the standing feet.

    Returns
    -------
    friction_torque
        Shape (T, n), NaN for position-controlled joints.
    wrench
        Ground reaction on each standing foot in its own frame, shape (T, m).
    """
    friction = np.full(torque.shape, np.nan)
    wrench = np.empty((len(torque), sum(robot.contacts[foot].size for foot in feet)))
    for k in range(len(torque)):
        sample = constrained_sample(robot, feet, state, torque, k)
        found = np.linalg.solve(sample.mobility, sample.difference)
        friction[k, robot.torque_controlled] = found
        change = np.linalg.solve(sample.constraint_inertia, sample.friction_response @ found)
        wrench[k] = (sample.multipliers + change)[: wrench.shape[1]]
    return friction, wrench
