"""How much more the parts of a log disagree about the model than errors of their equations would make them.

Errors that no window shares with the next average out within seconds. What friction of real robots does beyond its law,
and what cables and belts do, lasts longer: a fit that knows of windows alone takes it for bodies, and is sure of them.
The parts of a log tell. With S the curvature of chi^2 / 2 in the coordinates of the model, rotors included, friction
being fitted along, h_f the slope there that part f of P has at the best fit of all, and K = S^-1 (S - prior),

    D = sum h_f^T S^-1 h_f / tr(K - K^2 / P)

is one where errors are as independent, and the model as wrong, as they are taken to be.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.model import ModelCorrections
from stribeck.identification.whole_log.solve import Solution, curvature, inverse_of, times_jacobian
from stribeck.identification.whole_log.statistic import Statistic
from stribeck.log import Array

LEAST_KNOWN = 1.0
"""Coordinates [1] that a log must settle for its parts to disagree about."""


def disagreement(
    total: Statistic, parts: Sequence[Statistic], curves: Curves, model: ModelCorrections, solution: Solution
) -> float:
    """Return D [1], at least one, of the fit to a log, the total of its parts; one where nothing tells."""
    count, first = len(parts), solution.internal.size
    if count < 2 or not model.believed:
        return 1.0
    own, rest = np.arange(first, first + model.size), np.flatnonzero(~solution.held)
    matrix = curvature(total, curves, model, solution)
    across, beside = matrix[np.ix_(rest, own)], matrix[np.ix_(rest, rest)]
    corrected, bodies = model.values(solution.corrections)
    values = np.concatenate([curves.coefficients(solution.internal), corrected])
    pulls = np.stack([part.gram @ values - part.right for part in parts])
    slopes = times_jacobian(pulls, curves.jacobians(solution.internal), bodies, model.scales).T
    follow = inverse_of(beside) @ across
    left = slopes[own] - follow.T @ slopes[rest]
    inverse = inverse_of(matrix[np.ix_(own, own)] - across.T @ follow)
    known = np.eye(model.size) - inverse @ model.precision
    expected = float(np.trace(known) - np.sum(known * known.T) / count)
    squares = float(np.sum(left * (inverse @ left)))
    return max(1.0, squares / expected) if expected > LEAST_KNOWN else 1.0


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
