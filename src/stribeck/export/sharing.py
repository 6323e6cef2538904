"""How links that are fixed to each other share what a log says of their sum.

With P the pseudo-inertia of the sum, P' the one found, and A the affine map nearest to none with A P A^T = P', link k
gets A P_k A^T: space itself is scaled and shifted a little, and the links with it. The sum is then P', and each link is
one that can exist if it was before. Light links keep what they have, and the heaviest has the rest.
"""

import numpy as np
from scipy.linalg import sqrtm

from stribeck.typing import Array

LIGHT, EMPTY = 1e-2, 1e-9
"""Links lighter than this share of the sum [1] keep what they have: sensors, soles; or, if need be, only empty ones."""

LEAST_RADIUS = 1e-4
"""No link is smaller than such a radius of gyration [m]: rounding would make a flat one impossible."""


def share(links: Array, found: Array) -> Array:
    """Return the links' new pseudo-inertias.

    Parameters
    ----------
    links
        Pseudo-inertias in one frame, shape (L, 4, 4).
    found
        What their sum shall be, shape (4, 4).

    Returns
    -------
    shared
        Shape (L, 4, 4). Their sum is `found`, unless the rest that stays for the heaviest link were impossible.
    """
    carrier = _nearest_map(links.sum(axis=0), found)
    masses = links[:, 3, 3]
    heaviest = int(np.argmax(masses))
    for least in (LIGHT, EMPTY):
        shared = links.copy()
        for k in np.flatnonzero(masses > least * masses.sum()):
            shared[k] = possible(carrier @ links[k] @ carrier.T)
        rest = shared[heaviest] + found - shared.sum(axis=0)
        shared[heaviest] = possible(rest)
        if np.array_equal(shared[heaviest], rest):
            break
    return shared


def possible(matrix: Array) -> Array:
    """Return a pseudo-inertia, shape (4, 4), or the nearest one with second moments that a body can have."""
    mass, centre, moments = _split(matrix)
    values, axes = np.linalg.eigh(moments)
    least = mass * LEAST_RADIUS**2
    if values[0] >= least:
        return matrix
    raised = (axes * np.maximum(values, least)) @ axes.T
    return _joined(mass, centre, raised)


def _nearest_map(before: Array, after: Array) -> Array:
    """Return A, shape (4, 4), with A P A^T = P': the optimal transport between the two, with masses scaled."""
    mass, centre, moments = _split(possible(before))
    new_mass, new_centre, new_moments = _split(possible(after))
    root = np.real(sqrtm(moments))
    inverse = np.linalg.inv(root)
    turn = inverse @ np.real(sqrtm(root @ new_moments @ root)) @ inverse
    scale = np.sqrt(new_mass / mass)
    carrier = np.zeros((4, 4))
    carrier[:3, :3] = turn
    carrier[:3, 3] = scale * new_centre - turn @ centre
    carrier[3, 3] = scale
    return carrier


def _split(matrix: Array) -> tuple[float, Array, Array]:
    """Return mass, centre (3,) and second moments about it (3, 3) of a pseudo-inertia."""
    mass = float(matrix[3, 3])
    centre = matrix[:3, 3] / mass
    return mass, centre, matrix[:3, :3] - mass * np.outer(centre, centre)


def _joined(mass: float, centre: Array, moments: Array) -> Array:
    """Return the pseudo-inertia, shape (4, 4), of mass, centre and second moments about it."""
    first = mass * centre
    return np.block([[moments + np.outer(first, centre), first[:, None]], [first[None, :], np.array([[mass]])]])
