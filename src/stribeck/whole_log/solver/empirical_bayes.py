"""Empirical Bayes: priors whose standard deviations the log gives (docs/estimator.md, equations 23 to 25).

A standard deviation s is that under which the log is most likely: with coordinates u_i of variance C_ii,

    s^2 = sum u_i^2 / sum (1 - C_ii / s^2)

where the right sum counts how many of them the log determines (MacKay 1992). Model and sensors have one each, and so
have a joint's offsets in several logs; scales and pure numbers of a law have a group prior over the joints, mean and
standard deviation (Efron and Morris 1975).
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.whole_log.constants import (
    EMPIRICAL_BAYES_ROUNDS,
    GROUP_PSEUDO_COUNT,
    GROUP_STD,
    LARGEST_PRIOR_STD,
    MODEL_PSEUDO_COUNT,
)
from stribeck.whole_log.model.friction_curves import FIXED, Curves
from stribeck.whole_log.model.model_corrections import ModelCorrections
from stribeck.whole_log.solver.multistart import with_other_starts
from stribeck.whole_log.solver.normal_equations import NormalEquations
from stribeck.whole_log.solver.solve import Solution, solve


def solve_with_empirical_bayes(
    normal_equations: NormalEquations, curves: Curves, model: ModelCorrections, before: Solution
) -> tuple[Curves, ModelCorrections, Solution]:
    """Return curves and model with priors by empirical Bayes, and the solution with these.

    Once joints have a prior in common, one that is far from the others may turn out to be in a local minimum that was
    as good as theirs as long as it stood alone: all try their other starts.
    """
    solution = solve(normal_equations, curves, model, before)
    for _ in range(EMPIRICAL_BAYES_ROUNDS):
        first = curves.group_prior is None
        curves, model = learn_group_prior(curves, solution), _learn_prior_std(model, solution)
        solution = solve(normal_equations, curves, model, solution)
        if first:
            solution = with_other_starts(normal_equations, curves, model, solution)
    return curves, model, solution


def group_mean_covariance(curves: Curves, solution: Solution) -> Array:
    """Return what to add to a solution's covariance, as the means of the group priors are estimates too.

    With s the standard deviation of a coordinate over the joints, of which the log determines N, their mean has the
    variance s^2 / N, and all coordinates follow it by the sum of C / s^2 over the joints, C being the solution's
    covariance (Kass and Steffey 1989).
    """
    assert curves.group_prior is not None  # empirical Bayes has been
    added = np.zeros_like(solution.covariance)
    for k in np.flatnonzero(np.isfinite(curves.group_prior[1])).tolist():
        own, known = _determined(curves, solution, k)
        variance = curves.group_prior[1, k] ** 2
        follow = solution.covariance[:, solution.layout.each_joint(k, own)].sum(axis=1) / variance
        added += np.outer(follow, follow) * variance / (known.sum() + GROUP_PSEUDO_COUNT)
    return added


def _determined(curves: Curves, solution: Solution, parameter: int) -> tuple[NDArray[np.int64], Array]:
    """Return the joints that have a parameter, shape (m,), and how much of each the log determines, from 0 to 1."""
    joints = range(len(solution.internal))
    own = np.array([joint for joint in joints if curves.has(joint)[parameter]], dtype=np.int64)
    return own, (1 - solution.variance[own, parameter] / curves.prior[1][own, parameter] ** 2).clip(0, 1)


def learn_group_prior(curves: Curves, solution: Solution) -> Curves:
    """Return curves with the group prior of equations (24) and (25)."""
    mean, group_prior = curves.prior[0], np.full((2, solution.internal.shape[1]), np.nan)
    for k in curves.shared:
        own, known = _determined(curves, solution, k)
        if not len(own):
            continue
        off = solution.internal[own, k] - mean[own, k]
        total = known.sum() + GROUP_PSEUDO_COUNT
        group_mean = (np.sum(known * mean[own, k] + off) + GROUP_PSEUDO_COUNT * mean[own, k].mean()) / total
        squares = np.sum((off + known * (mean[own, k] - group_mean)) ** 2)
        beside = max(known.sum() - 1, 0.0) + GROUP_PSEUDO_COUNT  # one of them has gone into the mean
        group_prior[:, k] = group_mean, np.sqrt((squares + GROUP_PSEUDO_COUNT * GROUP_STD**2) / beside)
    return replace(curves, group_prior=group_prior)


def _learn_prior_std(model: ModelCorrections, solution: Solution) -> ModelCorrections:
    """Return model and sensors with the prior of equation (23)."""
    variance = solution.model_variance
    prior_std, dispersion, largest = model.prior_std.copy(), np.ones(model.size), np.full(model.size, np.inf)
    dispersion[model.layout.nearly_right], largest[model.layout.nearly_right] = model.overdispersion, LARGEST_PRIOR_STD
    for group in _groups(model):
        known = (1 - dispersion[group] * variance[group] / prior_std[group] ** 2).clip(0, 1).sum()
        square = np.sum(solution.corrections[group] ** 2)
        found = np.sqrt((square + MODEL_PSEUDO_COUNT) / (known + MODEL_PSEUDO_COUNT))
        prior_std[group] = np.minimum(found, largest[group])
    return replace(model, prior_std=prior_std)


def _groups(model: ModelCorrections) -> Iterator[NDArray[np.int64]]:
    """Yield the coordinates that have one prior standard deviation.

    Masses, centres, moments, gains, zeros, tilts, and the contrasts of each joint's offsets between logs.
    """
    places = np.arange(model.size)
    calibration = [places[model.layout.part(name)] for name in ("gains", "zeros", "tilts")]
    offsets = places[model.layout.part("log_offsets")].reshape(model.corrections.log_offsets).T
    for group in (*model.layout.body_groups(), *calibration, *offsets):
        if len(group) and model.prior_std[group[0]] > FIXED:
            yield group
