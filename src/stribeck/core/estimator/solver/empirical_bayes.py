"""Empirical Bayes: standard deviations of priors, estimated from the log (docs/estimator-fit.md, equations 23 to 25).

The standard deviation s maximizes the likelihood of the log. With coordinates u_i of variance C_ii,

    s^2 = sum u_i^2 / sum (1 - C_ii / s^2)

where the sum in the denominator is the number of coordinates that the log determines (MacKay 1992). The model, the
sensors and a joint's offsets in several logs have one standard deviation each. Scales and dimensionless numbers of a
law have a group prior over the joints with mean and standard deviation (Efron and Morris 1975). Pseudo-counts keep
priors unchanged if the log does not determine them.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.core.equations.constants import ROUNDS
from stribeck.core.estimator.model.laws import Laws
from stribeck.core.estimator.solver.elimination import solve
from stribeck.core.estimator.solver.fit import Fit
from stribeck.core.estimator.solver.statistics import Statistics

PSEUDO_COUNT = 0.03
"""Weight of the first group prior, as a number of joints [1]. A larger weight keeps wrong models uncorrected."""


def solve_with_empirical_bayes(statistics: Statistics, fit: Fit) -> Fit:
    """Fit with priors by empirical Bayes."""
    fit = solve(statistics, fit)
    for _ in range(ROUNDS + 1):
        model = fit.model.learned(fit.corrections, fit.model_variance)
        fit = solve(statistics, replace(fit, laws=learn_group_prior(fit), model=model))
    return fit


def group_mean_covariance(fit: Fit) -> Array:
    """Compute the covariance that the estimated means of the group priors add to a fit.

    If the log determines a coordinate of N joints, whose standard deviation over the joints is s, their mean has the
    variance s^2 / N. All coordinates depend on the mean by the sum of C / s^2 over the joints, with the covariance C
    (Kass and Steffey 1989).
    """
    assert fit.laws.group_prior is not None  # set by empirical Bayes
    added = np.zeros_like(fit.covariance)
    for k in np.flatnonzero(np.isfinite(fit.laws.group_prior[1])).tolist():
        joints, known = _determined(fit, k)
        variance = fit.laws.group_prior[1, k] ** 2
        follow = fit.covariance[:, joints * fit.internal.shape[1] + k].sum(axis=1) / variance
        added += np.outer(follow, follow) * variance / (known.sum() + PSEUDO_COUNT)
    return added


def _determined(fit: Fit, parameter: int) -> tuple[NDArray[np.int64], Array]:
    """Find the joints with a parameter, shape (k,), and the share of each that the log determines, from 0 to 1."""
    joints = np.flatnonzero(fit.laws.free[:, parameter])
    return joints, (1 - fit.variance[joints, parameter] / fit.laws.prior[1][joints, parameter] ** 2).clip(0, 1)


def learn_group_prior(fit: Fit) -> Laws:
    """Update the group prior by equations (24) and (25)."""
    mean, group_prior = fit.laws.prior[0], np.full((2, fit.internal.shape[1]), np.nan)
    for k in fit.laws.shared:
        joints, known = _determined(fit, k)
        if not len(joints):
            continue
        off = fit.internal[joints, k] - mean[joints, k]
        total = known.sum() + PSEUDO_COUNT
        group_mean = (np.sum(known * mean[joints, k] + off) + PSEUDO_COUNT * mean[joints, k].mean()) / total
        squares = np.sum((off + known * (mean[joints, k] - group_mean)) ** 2)
        degrees = max(known.sum() - 1, 0.0) + PSEUDO_COUNT  # one of them has gone into the mean
        deviation = np.sqrt((squares + PSEUDO_COUNT * 0.5**2) / degrees)  # 0.5 before any joint contributes
        group_prior[:, k] = group_mean, deviation
    return replace(fit.laws, group_prior=group_prior)
