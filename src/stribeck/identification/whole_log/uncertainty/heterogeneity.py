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

from stribeck.identification.whole_log.model.friction_curves import Curves
from stribeck.identification.whole_log.model.model_corrections import ModelCorrections
from stribeck.identification.whole_log.model.parametrisation import Parametrisation
from stribeck.identification.whole_log.solver.normal_equations import NormalEquations
from stribeck.identification.whole_log.solver.solve import Solution, curvature, inverse_of
from stribeck.typing import Array

LEAST_KNOWN = 0.5
"""Coordinates [1] that a log must settle for its parts to disagree about."""

CHANCE = 0.01
"""Probability [1] of parts to disagree by chance as much about a joint, or a parameter, whose intervals get wider."""


def heterogeneity(
    total: NormalEquations,
    parts: Sequence[NormalEquations],
    curves: Curves,
    model: ModelCorrections,
    solution: Solution,
) -> tuple[float, Array]:
    """Return D of the model, and of each joint's parameters, shape (n, p) [1]: at least one; one where nothing tells.

    Parameters
    ----------
    total, parts
        Of a log and of its parts.
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
    steps[free] = covariance[np.ix_(free, free)] @ slopes[free]  # of Gauss and Newton, that each part would take

    def ratio(own: NDArray[np.int64]) -> tuple[float, float]:
        """Return D, and of how many squares it is the mean."""
        block = np.ix_(own, own)
        known = np.eye(len(own)) - covariance[block] @ prior[block]
        expected = float(np.trace(known) - np.sum(known * known.T) / len(parts))
        squares = float(np.sum(steps[own] * (inverse_of(covariance[block]) @ steps[own])))
        return (squares / expected, expected * len(parts)) if expected > LEAST_KNOWN else (1.0, 1.0)

    if len(places[layout.nearly_right]):
        of_model = max(1.0, ratio(places[layout.model])[0])
    for joint in range(layout.joints):
        own = np.intersect1d(free, places[layout.joint(joint)][curves.has(joint)])
        for group in (own, *own[:, None]) if len(own) else ():
            found, squares = ratio(group)
            if found > chdtri(squares, CHANCE) / squares:
                which = group - layout.joint(joint).start
                of_friction[joint, which] = np.maximum(of_friction[joint, which], found)
    return of_model, of_friction


def overdispersion_of(heterogeneity: float, parts: int) -> float:
    """Return how many times larger squared errors are than they are taken to be [1], for a log of so many parts.

    What the parts share they do not show. It is taken to be as large as what they differ by: over P parts of equal
    size, the sum of what differs has the variance D - 1 in units of the errors, that of what is shared P times as much.
    """
    return 1 + (heterogeneity - 1) * (1 + parts)
