"""Heterogeneity over folds: how much more they differ than errors explain (docs/estimator.md, equations 26 and 27).

Errors of real robots last longer than a window: friction beyond the law, cables, belts. With S the curvature of a set
of coordinates when all others are fitted along, h_f the gradient of fold f of F at the fit of all, and K = S^-1 (S -
prior),

    D = sum h_f^T S^-1 h_f / tr(K - K^2 / F)

is one on average where errors of different windows are as independent as their covariance has them (Liang and Zeger
1986). The sets are the model's coordinates, rotors included, and a joint's parameters, all together and each by itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri, fdtri

from stribeck.base.typing import Array
from stribeck.whole_log.constants import HETEROGENEITY_P, LEAST_DETERMINED
from stribeck.whole_log.model.friction_curves import Curves
from stribeck.whole_log.model.model_corrections import ModelCorrections
from stribeck.whole_log.model.parametrisation import Parametrisation
from stribeck.whole_log.solver.normal_equations import NormalEquations
from stribeck.whole_log.solver.solve import Solution, curvature, inverse_of


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
    places, steps = np.arange(layout.size), _fold_steps(total, parts, curves, model, solution)
    free, ratio = steps.free, steps.ratio
    if len(places[layout.nearly_right]):
        of_model = max(1.0, ratio(places[layout.part("bodies", "rotors")])[0])
    for joint in range(layout.joints):
        own = np.intersect1d(free, places[layout.joint(joint)][curves.has(joint)])
        for group in (own, *own[:, None]) if len(own) else ():
            found, squares = ratio(group)
            if found > chdtri(squares, HETEROGENEITY_P) / squares:
                which = group - layout.joint(joint).start
                of_friction[joint, which] = np.maximum(of_friction[joint, which], found)
    return of_model, of_friction


def offsets_that_differ(
    total: NormalEquations,
    parts: Sequence[NormalEquations],
    curves: Curves,
    model: ModelCorrections,
    solution: Solution,
) -> NDArray[np.bool_]:
    """Return which joints' offsets differ from log to log by more than those of folds, shape (joints,).

    It is a Wald test of the k contrasts x of a joint, whose covariance C is multiplied by their own D, as errors of
    real robots last: x^T C^-1 x / (k D) has the distribution F(k, k (F - 1)) where logs do not differ. Parameters are
    those of `heterogeneity`.
    """
    contrasts, joints = model.corrections.log_offsets
    if len(parts) < 2 or not joints:
        return np.zeros(joints, dtype=bool)
    steps = _fold_steps(total, parts, curves, model, solution)
    places = np.arange(solution.layout.size)[solution.layout.part("log_offsets")].reshape(contrasts, joints)
    differ = []
    for own in places.T:
        x, covariance = solution.x[own], steps.covariance[np.ix_(own, own)]
        wald = float(x @ inverse_of(covariance) @ x) / (contrasts * max(1.0, steps.ratio(own)[0]))
        differ.append(wald > fdtri(contrasts, contrasts * (len(parts) - 1), 1 - HETEROGENEITY_P))
    return np.array(differ)


@dataclass(frozen=True, eq=False)
class _FoldSteps:
    """Newton steps of each fold from the fit of all, shape (m, F); zero, as the covariance, for what a bound holds."""

    free: NDArray[np.int64]
    covariance: Array
    steps: Array
    prior: Array

    def ratio(self, own: NDArray[np.int64]) -> tuple[float, float]:
        """Return D of some coordinates, and of how many squares it is the mean."""
        block, folds = np.ix_(own, own), self.steps.shape[1]
        known = np.eye(len(own)) - self.covariance[block] @ self.prior[block]
        expected = float(np.trace(known) - np.sum(known * known.T) / folds)
        squares = float(np.sum(self.steps[own] * (inverse_of(self.covariance[block]) @ self.steps[own])))
        return (squares / expected, expected * folds) if expected > LEAST_DETERMINED else (1.0, 1.0)


def _fold_steps(
    total: NormalEquations,
    parts: Sequence[NormalEquations],
    curves: Curves,
    model: ModelCorrections,
    solution: Solution,
) -> _FoldSteps:
    """Return the steps of the folds; parameters are those of `heterogeneity`."""
    layout, parameters = solution.layout, Parametrisation(curves, model)
    values = parameters.values(solution.x)
    gradients = np.stack([part.information @ values - part.right_hand_side for part in parts])
    slopes = parameters.times_jacobian(gradients, parameters.blocks(solution.x)).T
    places = np.arange(layout.size)
    free = np.setdiff1d(places, places[layout.friction][solution.at_bound.ravel()])
    covariance, steps = np.zeros((layout.size, layout.size)), np.zeros((layout.size, len(parts)))
    covariance[np.ix_(free, free)] = inverse_of(curvature(total, curves, model, solution)[np.ix_(free, free)])
    steps[free] = covariance[np.ix_(free, free)] @ slopes[free]
    return _FoldSteps(free, covariance, steps, parameters.prior[1])


def overdispersion_of(heterogeneity: float, parts: int) -> float:
    """Return the overdispersion [1] of the model's coordinates, 1 + (D - 1)(1 + F) for F folds: equation (27).

    Errors that all folds share do not show in D. They are assumed to be as large as those that differ: over F folds of
    equal size, the sum of these has the variance D - 1 in units of the errors, that of the shared ones F times as much.
    """
    return 1 + (heterogeneity - 1) * (1 + parts)
