"""How much more the parts of a log disagree about the model than errors of their equations would make them.

Errors that no window shares with the next average out within seconds. What friction of real robots does beyond its law,
and what cables and belts do, lasts longer: a fit that knows of windows alone takes it for bodies, and is sure of them.
The parts of a log tell. With S the curvature of chi^2 / 2 in the coordinates of the model, rotors included, friction
being fitted along, h_f the slope there that part f of P has at the best fit of all, and K = S^-1 (S - prior),

    D = sum h_f^T S^-1 h_f / tr(K - K^2 / P)

is one where errors are as independent, and the model as wrong, as they are taken to be. The same of all parameters
of a joint's friction, and of each, says how much wider their intervals must be.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.model import ModelCorrections
from stribeck.identification.whole_log.solve import Solution, curvature, inverse_of, times_jacobian
from stribeck.identification.whole_log.statistic import Statistic
from stribeck.typing import Array

LEAST_KNOWN = 0.5
"""Coordinates [1] that a log must settle for its parts to disagree about."""

CHANCE = 0.01
"""Probability [1] of parts to disagree by chance as much about a joint, or a parameter, whose intervals get wider."""


def disagreement(
    total: Statistic, parts: Sequence[Statistic], curves: Curves, model: ModelCorrections, solution: Solution
) -> tuple[float, Array]:
    """Return D of the model, and of each joint's parameters, shape (n, p) [1]: at least one; one where nothing tells.

    Parameters
    ----------
    total, parts
        Of a log and of its parts.
    curves, model, solution
        The fit to the log.
    """
    (joints, count), coordinates = solution.internal.shape, len(solution.covariance)
    if len(parts) < 2:
        return 1.0, np.ones((joints, count))
    corrected, bodies = model.values(solution.corrections)
    values = np.concatenate([curves.coefficients(solution.internal), corrected])
    pulls = np.stack([part.gram @ values - part.right for part in parts])
    slopes = times_jacobian(pulls, curves.jacobians(solution.internal), bodies, model.scales).T
    prior = np.zeros((coordinates, coordinates))
    prior[joints * count :, joints * count :] = model.precision
    prior[range(joints * count), range(joints * count)] = (curves.prior()[1] ** -2).ravel()
    free = np.flatnonzero(~np.concatenate([solution.held.ravel(), np.zeros(model.size, dtype=bool)]))
    covariance, steps = np.zeros((coordinates, coordinates)), np.zeros((coordinates, len(parts)))
    covariance[np.ix_(free, free)] = inverse_of(curvature(total, curves, model, solution)[np.ix_(free, free)])
    steps[free] = covariance[np.ix_(free, free)] @ slopes[free]  # of Gauss and Newton, that each part would take

    def ratio(own: NDArray[np.int64]) -> tuple[float, float]:
        """Return D, and of how many squares it is the mean."""
        block = np.ix_(own, own)
        known = np.eye(len(own)) - covariance[block] @ prior[block]
        expected = float(np.trace(known) - np.sum(known * known.T) / len(parts))
        squares = float(np.sum(steps[own] * (inverse_of(covariance[block]) @ steps[own])))
        return (squares / expected, expected * len(parts)) if expected > LEAST_KNOWN else (1.0, 1.0)

    of_model, of_friction = 1.0, np.ones((joints, count))
    if model.believed:
        of_model = max(1.0, ratio(joints * count + np.arange(model.size))[0])
    for joint in range(joints):
        own = np.intersect1d(free, joint * count + np.flatnonzero(curves.has(joint)))
        for group in (own, *own[:, None]) if len(own) else ():
            found, squares = ratio(group)
            if found > chdtri(squares, CHANCE) / squares:
                which = group - joint * count
                of_friction[joint, which] = np.maximum(of_friction[joint, which], found)
    return of_model, of_friction


def doubt_of(disagreement: float, parts: int) -> float:
    """Return how many times larger squared errors are than they are taken to be [1], for a log of so many parts.

    What the parts share they do not show. It is taken to be as large as what they differ by: over P parts of equal
    size, the sum of what differs has the variance D - 1 in units of the errors, that of what is shared P times as much.
    """
    return 1 + (disagreement - 1) * (1 + parts)


def by_doubt(model: ModelCorrections, solution: Solution) -> Array:
    """Return what to add to a solution's covariance, as what is not known of the model is more by the doubt.

    With b the model's coordinates, C + (doubt - 1) C[:, b] C[b, b]^-1 C[b, :]: that of b is multiplied by it, and
    friction's share that comes from b with it.
    """
    first = solution.internal.size
    own = slice(first, first + model.believed)
    across = solution.covariance[own]
    return np.asarray((model.doubt - 1) * across.T @ (inverse_of(across[:, own]) @ across))
