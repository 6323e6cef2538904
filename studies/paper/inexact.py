"""Robots with wrong models: the errors of section 7.2 of the paper, and displaced masses.

The log does not change; only the estimator uses the wrong model.
"""

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array
from stribeck.paper.figures.inertias import Change, scaled


def displaced(offset: Array) -> Change:
    """Make a change that moves a body's center of mass by an offset [m] in the body's frame, shape (3,)."""
    return lambda inertia: pin.Inertia(inertia.mass, inertia.lever + offset, inertia.inertia)


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
