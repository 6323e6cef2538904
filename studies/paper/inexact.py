"""Robots with wrong models: the errors of section 7.2 of the paper, and displaced masses.

The log does not change; only the estimator uses the wrong model.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin

from stribeck import Robot
from stribeck.base.typing import Array

Change = Callable[[pin.Inertia], pin.Inertia]
"""Function that changes a body's inertia."""
ROOT = "pelvis"
"""Name of the root's body; all other bodies are named after the joint that moves them."""


def body_names(robot: Robot) -> tuple[str, ...]:
    """List the names of a floating robot's bodies, in the order of its model."""
    return (ROOT, *map(str, list(robot.tree.model.names)[2:]))


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


def with_bodies(robot: Robot, change: Change, bodies: tuple[str, ...] | None = None) -> Robot:
    """Change the inertia of the named bodies, or of all bodies."""
    model = pin.Model(robot.tree.model)
    for k, name in enumerate(body_names(robot), start=1):
        if bodies is None or name in bodies:
            model.inertias[k] = change(model.inertias[k])
    return replace(robot, tree=replace(robot.tree, model=model))


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
