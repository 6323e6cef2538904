"""Heterogeneity: differences between folds relative to their errors (docs/estimator-fit.md, equations 26 and 27).

Errors of real robots last longer than a window: friction outside the law, cables, belts. For a set of coordinates with
curvature S (all others refitted), gradient h_f of fold f of F at the common fit, and K = S^-1 (S - prior),

    D = sum h_f^T S^-1 h_f / tr(K - K^2 / F)

is one on average if the errors of different windows match their covariance. The sets are the model's coordinates with
rotors, and each joint's friction. A joint's D has few degrees of freedom, so that it is averaged with the mean of all
joints. With the Newton steps s_f = C h_f, the cluster-robust covariance (Liang and Zeger 1986)

    V = F / (F - 1) sum s_f s_f^T

shows which coordinates differ between folds. It has even fewer degrees of freedom, so that intervals use its mean with
the inverse curvature C times D (Ledoit and Wolf 2004).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy  # its linalg is slow to import: loaded at its first use
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.core.estimator.solver.empirical_bayes import solve_with_empirical_bayes
from stribeck.core.estimator.solver.fit import Fit
from stribeck.core.estimator.solver.positive_definite import inverse_of
from stribeck.core.estimator.solver.statistics import Statistics


@dataclass(frozen=True, eq=False)
class Heterogeneity:
    """D of the model and of each joint's friction, shape (n,) [1], at least one, and V of all coordinates, (m, m)."""

    model: float
    joints: Array
    covariance: Array | None = None


def heterogeneity(whole: Statistics, parts: Sequence[Statistics], fit: Fit) -> Heterogeneity:
    """Compute the heterogeneity of a fit to a log over its folds, given the statistics of both."""
    layout, joints, size = fit.layout, len(fit.internal), fit.layout.size
    if len(parts) < 2:
        return Heterogeneity(1.0, np.ones(joints))
    values = fit.values
    slopes = fit.pulled(np.stack([part.information @ values - part.right for part in parts], axis=1))
    free = np.append(~fit.at_bound.ravel() & fit.laws.free.ravel(), np.ones(size - fit.internal.size, dtype=bool))
    block = np.ix_(free, free)
    covariance, steps = np.zeros((size, size)), np.zeros((size, len(parts)))  # zero for coordinates at a bound
    covariance[block] = inverse_of(fit.curvature(whole)[block])
    steps[free] = covariance[block] @ slopes[free]
    prior = scipy.linalg.block_diag(np.diag(fit.laws.prior[1].ravel() ** -2.0), fit.model.precision)

    def ratio(places: NDArray[np.int64]) -> tuple[float, float]:
        """Compute D of some coordinates, and the number of squares in this mean."""
        places = places[free[places]]
        block = np.ix_(places, places)
        known = np.eye(len(places)) - covariance[block] @ prior[block]
        expected = float(np.trace(known) - np.sum(known * known.T) / len(parts))
        squares = float(np.sum(steps[places] * (inverse_of(covariance[block]) @ steps[places])))
        return (squares / expected, expected * len(parts)) if expected > 0.5 else (1.0, 0.0)

    every = np.arange(size)
    model = layout.places("bodies", "rotors") if len(layout.places("bodies", "base_delay")) else every[:0]
    ratios, squares = np.array([ratio(every[layout.joint(k)][own]) for k, own in enumerate(fit.laws.free)]).T
    mean = float(ratios @ squares / max(squares.sum(), 1.0))
    of_folds = len(parts) / (len(parts) - 1) * steps @ steps.T
    return Heterogeneity(max(1.0, ratio(model)[0]), np.maximum(1.0, (ratios + mean) / 2), of_folds)


def solve_overdispersed(
    whole: Statistics, parts: Sequence[Statistics], start: Fit
) -> tuple[Fit, Heterogeneity, Heterogeneity]:
    """Fit with empirical Bayes and the overdispersion of the model; return the heterogeneity without and with it."""
    fit = solve_with_empirical_bayes(whole, start)
    before = heterogeneity(whole, parts, fit)
    if before.model <= 1:
        return fit, before, before
    model = replace(fit.model, overdispersion=overdispersion_of(before.model, len(parts)))
    fit = solve_with_empirical_bayes(whole, replace(fit, model=model))
    return fit, before, heterogeneity(whole, parts, fit)


def overdispersion_of(heterogeneity: float, parts: int) -> float:
    """Compute the overdispersion [1] of the model's coordinates, 1 + (D - 1)(1 + F / 4) for F folds: equation (27).

    Errors that all folds share do not affect D. They are assumed to be half as large as the errors that differ between
    folds. Over F folds of equal size, the sum of differing errors has the variance D - 1 in units of the errors, and
    the sum of shared errors F / 4 times as much.
    """
    return 1 + (heterogeneity - 1) * (1 + parts / 4)
