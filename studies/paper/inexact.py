"""Robots whose model is wrong, in the ways that section 7.2 of the paper tries, and one more: a displaced mass.

The log stays as it is; only the estimator believes in another robot.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin

from stribeck import Robot
from stribeck.base.typing import Array

Change = Callable[[pin.Inertia], pin.Inertia]
"""What is done to a body's inertia."""
ROOT = "pelvis"
"""Name that the root's body gets; every other one has that of the joint that moves it."""


def body_names(robot: Robot) -> tuple[str, ...]:
    """Return the names of a floating robot's bodies, in the order of its model."""
    return (ROOT, *map(str, list(robot.tree.model.names)[2:]))


def scaled(mass: float = 1.0, moments: float = 1.0) -> Change:
    """Return what scales the eigenvalues of a body's 6x6 inertia matrix: those of mass, those of moment, or both.

    The matrix is that about the centre of mass. About any other point translation and rotation share eigenvectors, and
    a matrix with scaled eigenvalues is no rigid body's.
    """

    def change(inertia: pin.Inertia) -> pin.Inertia:
        values, vectors = np.linalg.eigh(pin.Inertia(inertia.mass, np.zeros(3), inertia.inertia).matrix())
        rotates = np.sum(vectors[3:] ** 2, axis=0) > 0.5
        matrix = vectors * values * np.where(rotates, moments, mass) @ vectors.T
        return pin.Inertia(float(matrix[0, 0]), inertia.lever, matrix[3:, 3:])

    return change


def displaced(offset: Array) -> Change:
    """Return what moves a body's centre of mass by an offset [m] in the body's frame, shape (3,)."""
    return lambda inertia: pin.Inertia(inertia.mass, inertia.lever + offset, inertia.inertia)


def with_bodies(robot: Robot, change: Change, bodies: tuple[str, ...] | None = None) -> Robot:
    """Return the robot with some of its bodies changed, or with all."""
    model = pin.Model(robot.tree.model)
    for k, name in enumerate(body_names(robot), start=1):
        if bodies is None or name in bodies:
            model.inertias[k] = change(model.inertias[k])
    return replace(robot, tree=replace(robot.tree, model=model))


def drawn(seed: int, mass: float = 0.05, moments: float = 0.2, offset: float = 0.01) -> Change:
    """Return what is wrong with each body in its own way, all drawn from a seed, evenly between plus and minus.

    Parameters
    ----------
    seed
        Of the errors.
    mass, moments
        Largest share by which masses and principal moments are off.
    offset
        Largest displacement of a centre of mass along each axis [m].
    """
    generator = np.random.default_rng(seed)

    def change(inertia: pin.Inertia) -> pin.Inertia:
        heavier, larger = 1 + generator.uniform(-1, 1, 2) * (mass, moments)
        return displaced(generator.uniform(-offset, offset, 3))(scaled(heavier, larger)(inertia))

    return change
