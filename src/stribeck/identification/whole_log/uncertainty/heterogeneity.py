"""Heterogeneity over folds: how much more they differ than errors explain (docs/estimator.md, equations 26 and 27).

Errors of real robots last longer than a window: friction beyond the law, cables, belts. With S the curvature of a set
of coordinates when all others are fitted along, h_f the gradient of fold f of F at the fit of all, and K = S^-1 (S -
prior),

    D = sum h_f^T S^-1 h_f / tr(K - K^2 / F)

is one on average where errors of different windows are as independent as their covariance has them (Liang and Zeger
1986). The sets are the model's coordinates, rotors included, and a joint's parameters, all together and each by itself.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from stribeck.identification.whole_log.constants import HETEROGENEITY_P, LEAST_DETERMINED
from stribeck.identification.whole_log.model.friction_curves import Curves
from stribeck.identification.whole_log.model.model_corrections import ModelCorrections
from stribeck.identification.whole_log.model.parametrisation import Parametrisation
from stribeck.identification.whole_log.solver.normal_equations import NormalEquations
from stribeck.identification.whole_log.solver.solve import Solution, curvature, inverse_of
from stribeck.typing import Array


def heterogeneity(
    total: NormalEquations,
    parts: Sequence[NormalEquations],
    curves: Curves,
    model: ModelCorrections,
    solution: Solution,
) -> tuple[float, Array]:
    """Return D of the model, and of each joint's parameters, shape (n, p) [1]: at least one.

    Parameters
    ----------
    total, parts
        Of a log and of its folds.
    curves, model, solution
        The fit to the log.
    """
    layout, of_model, of_friction = solution.layout, 1.0, np.ones(solution.internal.shape)
    if len(parts) < 2:
        return of_model, of_friction
    parameters = Parametrisation(curves, model)
    values = parameters.values(solution.x)
    gradients = np.stack([part.information @ values - part.right_hand_side for part in parts])
    slopes = parameters.times_jacobian(gradients, solution.x).T
    prior = parameters.prior[1]
    places = np.arange(layout.size)
    free = np.setdiff1d(places, places[layout.friction][solution.at_bound.ravel()])
    covariance, steps = np.zeros((layout.size, layout.size)), np.zeros((layout.size, len(parts)))
    covariance[np.ix_(free, free)] = inverse_of(curvature(total, curves, model, solution)[np.ix_(free, free)])
    steps[free] = covariance[np.ix_(free, free)] @ slopes[free]  # Newton steps of each fold

    def ratio(own: NDArray[np.int64]) -> tuple[float, float]:
        """Return D, and of how many squares it is the mean."""
        block = np.ix_(own, own)
        known = np.eye(len(own)) - covariance[block] @ prior[block]
        expected = float(np.trace(known) - np.sum(known * known.T) / len(parts))
        squares = float(np.sum(steps[own] * (inverse_of(covariance[block]) @ steps[own])))
        return (squares / expected, expected * len(parts)) if expected > LEAST_DETERMINED else (1.0, 1.0)

    if len(places[layout.nearly_right]):
        of_model = max(1.0, ratio(places[layout.model])[0])
    for joint in range(layout.joints):
        own = np.intersect1d(free, places[layout.joint(joint)][curves.has(joint)])
        for group in (own, *own[:, None]) if len(own) else ():
            found, squares = ratio(group)
            if found > chdtri(squares, HETEROGENEITY_P) / squares:
                which = group - layout.joint(joint).start
                of_friction[joint, which] = np.maximum(of_friction[joint, which], found)
    return of_model, of_friction


def overdispersion_of(heterogeneity: float, parts: int) -> float:
    """Return the overdispersion [1] of the model's coordinates, 1 + (D - 1)(1 + F) for F folds: equation (27).

    Errors that all folds share do not show in D. They are assumed to be as large as those that differ: over F folds of
    equal size, the sum of these has the variance D - 1 in units of the errors, that of the shared ones F times as much.
    """
    return 1 + (heterogeneity - 1) * (1 + parts)
