"""Robots with wrong models: the errors of section 7.2 of the paper, and displaced masses.

The log does not change; only the estimator uses the wrong model.
"""

from collections.abc import Callable

import numpy as np
import pinocchio as pin

from stribeck import Robot
from stribeck.core.base.typing import Array
from studies.changes import with_body

Change = Callable[[pin.Inertia], pin.Inertia]
"""Function that changes a body's inertia."""


def scaled(mass: float = 1.0, moments: float = 1.0) -> Change:
    """Make a change that scales a body's mass and principal moments, eigenvalues of its 6x6 inertia matrix.

    The matrix refers to the center of mass. About any other point, translation and rotation share eigenvectors, and a
    matrix with scaled eigenvalues belongs to no rigid body.
    """

    def change(inertia: pin.Inertia) -> pin.Inertia:
        values, vectors = np.linalg.eigh(pin.Inertia(inertia.mass, np.zeros(3), inertia.inertia).matrix())
        rotates = np.sum(vectors[3:] ** 2, axis=0) > 0.5
        matrix = vectors * values * np.where(rotates, moments, mass) @ vectors.T
        return pin.Inertia(float(matrix[0, 0]), inertia.lever, matrix[3:, 3:])

    return change


def displaced(offset: Array) -> Change:
    """Make a change that moves a body's center of mass by an offset [m] in the body's frame, shape (3,)."""
    return lambda inertia: pin.Inertia(inertia.mass, inertia.lever + offset, inertia.inertia)


def with_bodies(robot: Robot, change: Change) -> Robot:
    """Change the inertia of all bodies."""
    for k in range(1, robot.tree.model.njoints):
        robot = with_body(robot, k, change)
    return robot


def drawn(seed: int, mass: float = 0.05, moments: float = 0.2, offset: float = 0.01) -> Change:
    """Make a change that draws different errors for every body, uniformly within the given limits.

    Parameters
    ----------
    seed
        Seed of the errors.
    mass, moments
        Largest relative error of masses and of principal moments [1].
    offset
        Largest displacement of a center of mass along each axis [m].
    """
    generator = np.random.default_rng(seed)

    def change(inertia: pin.Inertia) -> pin.Inertia:
        heavier, larger = 1 + generator.uniform(-1, 1, 2) * (mass, moments)
        return displaced(generator.uniform(-offset, offset, 3))(scaled(heavier, larger)(inertia))

    return change
