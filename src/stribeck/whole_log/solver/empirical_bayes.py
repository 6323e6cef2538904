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

from stribeck.base.typing import Array
from stribeck.whole_log.constants import ROUNDS
from stribeck.whole_log.model.corrections import ModelCorrections
from stribeck.whole_log.model.laws import Laws
from stribeck.whole_log.solver.elimination import EachJoint, Fit, eliminate, solve
from stribeck.whole_log.solver.statistics import Statistics

PSEUDO_COUNT = 0.03
"""Weight of the first group prior, as a number of joints [1]. A larger weight keeps wrong models uncorrected."""


FLOOR = 1e-5
"""Weight of the first prior of model and sensors, as a number of coordinates [1].

With 1e-3, equal offsets differ between logs by 2 % of their first prior, and curves are up to 9 % further off."""


def solve_with_empirical_bayes(statistics: Statistics, fit: Fit) -> Fit:
    """Fit with priors by empirical Bayes.

    A joint may be in a local minimum that was as good as others without the common prior, but is far from the other
    joints. Therefore all joints try their other starts once they share the prior.
    """
    fit = solve(statistics, fit)
    for _ in range(ROUNDS + 1):
        first = fit.laws.group_prior is None
        fit = solve(statistics, replace(fit, laws=learn_group_prior(fit), model=_learn_prior_std(fit)))
        if first:
            fit = with_other_starts(statistics, fit)
    return fit


def with_other_starts(statistics: Statistics, fit: Fit) -> Fit:
    """Try other starts for each joint with all else fixed, and return the best fit.

    Some minima have no gradient towards a better one: without a Stribeck effect, for example, the Stribeck velocity
    has no effect on the curve.
    """
    left, laws = eliminate(statistics, fit.model, fit.corrections), fit.laws
    theta = laws.coefficients(fit.internal)
    information = blocks(left.information, len(theta))
    others = (left.information @ theta.ravel()).reshape(theta.shape) - (information @ theta[:, :, None])[:, :, 0]
    right = left.right.reshape(theta.shape) - others
    internal, costs = best_starts(laws, information, right)
    better = costs < EachJoint(laws, information, right).costs(fit.internal) - 0.05  # less: the same minimum
    if not better.any():
        return fit
    other = solve(statistics, replace(fit, internal=np.where(better[:, None], internal, fit.internal)))
    return min(fit, other, key=lambda each: cost_of(each))


def cost_of(fit: Fit) -> float:
    """Compute half of chi^2, with the prior's share."""
    mean, deviation = fit.laws.prior
    off = fit.corrections - fit.model.prior_mean
    share = np.sum(((fit.internal - mean) / deviation) ** 2) + off @ fit.model.precision @ off
    return 0.5 * float(fit.chi_square + share)


def best_starts(laws: Laws, information: Array, right: Array) -> tuple[Array, Array]:
    """Run descents from each joint's four best starts; return the best end, shape (n, w), and its cost, shape (n,).

    The joints' normal equations have shape (n, q, q) and (n, q).
    """
    starts = [laws.linear_starts(k, *each)[:4] for k, each in enumerate(zip(information, right, strict=True))]
    owners = np.repeat(np.arange(len(starts)), [len(each) for each in starts])
    ends, costs = EachJoint(laws.of(owners), information[owners], right[owners]).best(np.concatenate(starts))
    places = [np.flatnonzero(owners == k)[np.argmin(costs[owners == k])] for k in range(len(starts))]
    return ends[places], costs[places]


def best_of_linear(laws: Laws, theta: Array, covariance: Array) -> Array:
    """Find the internal coordinates of laws that fit linear coefficients best, shape (n, w).

    The joints' coefficients have shape (n, q). Their covariance, shape (n, q, q), includes all other uncertainty.
    """
    information = np.asarray(np.linalg.inv(covariance))
    return best_starts(laws, information, (information @ theta[:, :, None])[:, :, 0])[0]


def blocks(information: Array, joints: int) -> Array:
    """Extract the blocks of single joints, shape (n q, n q) -> (n, q, q)."""
    q = len(information) // joints
    return information.reshape(joints, q, joints, q)[range(joints), :, range(joints)].copy()


def group_mean_covariance(fit: Fit) -> Array:
    """Compute the covariance that the estimated means of the group priors add to a fit.

    If the log determines a coordinate of N joints, whose standard deviation over the joints is s, their mean has the
    variance s^2 / N. All coordinates depend on the mean by the sum of C / s^2 over the joints, with the covariance C
    (Kass and Steffey 1989).
    """
    assert fit.laws.group_prior is not None  # set by empirical Bayes
    added = np.zeros_like(fit.covariance)
    for k in np.flatnonzero(np.isfinite(fit.laws.group_prior[1])).tolist():
        own, known = _determined(fit, k)
        variance = fit.laws.group_prior[1, k] ** 2
        follow = fit.covariance[:, own * fit.internal.shape[1] + k].sum(axis=1) / variance
        added += np.outer(follow, follow) * variance / (known.sum() + PSEUDO_COUNT)
    return added


def _determined(fit: Fit, parameter: int) -> tuple[NDArray[np.int64], Array]:
    """Find the joints with a parameter, shape (k,), and the share of each that the log determines, from 0 to 1."""
    own = np.flatnonzero(fit.laws.free[:, parameter])
    return own, (1 - fit.variance[own, parameter] / fit.laws.prior[1][own, parameter] ** 2).clip(0, 1)


def learn_group_prior(fit: Fit) -> Laws:
    """Update the group prior by equations (24) and (25)."""
    mean, group_prior = fit.laws.prior[0], np.full((2, fit.internal.shape[1]), np.nan)
    for k in fit.laws.shared:
        own, known = _determined(fit, k)
        if not len(own):
            continue
        off = fit.internal[own, k] - mean[own, k]
        total = known.sum() + PSEUDO_COUNT
        group_mean = (np.sum(known * mean[own, k] + off) + PSEUDO_COUNT * mean[own, k].mean()) / total
        squares = np.sum((off + known * (mean[own, k] - group_mean)) ** 2)
        beside = max(known.sum() - 1, 0.0) + PSEUDO_COUNT  # one of them has gone into the mean
        deviation = np.sqrt((squares + PSEUDO_COUNT * 0.5**2) / beside)  # 0.5 before any joint contributes
        group_prior[:, k] = group_mean, deviation
    return replace(fit.laws, group_prior=group_prior)


def _learn_prior_std(fit: Fit) -> ModelCorrections:
    """Update the prior of model and sensors by equation (23).

    It is at most `largest` times the initial prior of bodies, and the initial prior of sensors. Otherwise these
    would explain errors of other kinds, more in every round.
    """
    model = fit.model
    prior_std, dispersion = model.prior_std.copy(), np.ones(len(model.prior_std))
    dispersion[model.nearly_right] = model.overdispersion
    for group in model.groups():
        known = (1 - dispersion[group] * fit.model_variance[group] / prior_std[group] ** 2).clip(0, 1).sum()
        squares = np.sum((fit.corrections[group] - model.prior_mean[group]) ** 2)
        largest = 1.0 if group[0] < model.nearly_right.stop else np.inf
        if group[0] < model.layout.part("bodies").stop:
            largest = model.largest
        prior_std[group] = min(np.sqrt((squares + FLOOR) / (known + FLOOR)), largest)
    return replace(model, prior_std=prior_std)
