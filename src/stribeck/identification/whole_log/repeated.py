"""What errors that come back with every step do to the intervals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stribeck.equations import Corrections
from stribeck.identification.whole_log.bodies import bodies_of
from stribeck.identification.whole_log.cosines import COSINES
from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.model import ModelCorrections
from stribeck.identification.whole_log.solve import Solution, curvature, solve
from stribeck.identification.whole_log.statistic import Statistic
from stribeck.log import Array
from stribeck.pseudo_inertia import SIZE

FIRST, LEAST = 0.01, 1e-4
"""Standard deviation of the repeated torques to begin with, and the least [N m]."""

ROUNDS = 3
"""How often it is measured [1]."""


def spread_of_repeated(
    statistic: Statistic, total: int, curves: Curves, model: ModelCorrections, solution: Solution
) -> tuple[Array, Array]:
    """Return the repeated torques' standard deviation in each joint [N m], shape (n,), and the solution's covariance.

    With A the curvature, Z the repeated torques' columns and Q their variances, an estimate that leaves them out has

        A^-1 + A^-1 (J^T Sigma^-1 Z) Q (J^T Sigma^-1 Z)^T A^-1

    Q is measured by fits that have these torques: each variance is their sum of squares over how many of them the log
    determines (MacKay 1992).

    Parameters
    ----------
    statistic
        Of a share of the log, with the columns Z; without any where there are no steps.
    total
        Number of equations of the whole log.
    curves, model, solution
        Of the whole log, without these torques.
    """
    joints = len(curves.top_speed)
    if not statistic.gaits:
        return np.zeros(joints), solution.covariance
    columns = statistic.gaits * COSINES * joints
    rest = without_corrections(statistic, model, solution)
    nothing = bodies_of(np.zeros((0, SIZE)))
    tried = ModelCorrections(Corrections(), nothing, np.arange(0), statistic.gaits, np.full(joints, FIRST), np.zeros(0))
    free = replace(solution, corrections=np.zeros(columns))
    for _ in range(ROUNDS):
        free = solve(rest, curves, tried, free)
        square = (free.corrections**2).reshape(-1, joints).sum(axis=0)
        variance = np.diag(free.covariance)[solution.internal.size :]
        known = (1 - variance).reshape(-1, joints).sum(axis=0)  # how many the log determines
        growth = np.sqrt(square / np.maximum(known, 1.0))
        tried = replace(tried, repeated=np.maximum(tried.repeated * growth, LEAST))
        free = replace(free, corrections=np.zeros(columns))
    both = replace(model, gaits=tried.gaits, repeated=tried.repeated)
    at = replace(solution, corrections=np.concatenate([solution.corrections, np.zeros(columns)]))
    cross = curvature(statistic, curves, both, at)[:-columns, -columns:] * (total / statistic.count)
    bias = solution.covariance @ cross
    return tried.repeated, solution.covariance + bias @ bias.T


def without_corrections(statistic: Statistic, model: ModelCorrections, solution: Solution) -> Statistic:
    """Return the statistic of friction and repeated torques alone, the corrections being what a solution says."""
    size, corrections = statistic.nodes.size, model.size
    kept = np.r_[0:size, size + corrections : len(statistic.right)]
    taken = np.zeros(len(statistic.right))
    taken[size : size + corrections] = model.values(solution.corrections)[0]
    rest = Statistic(statistic.nodes, len(kept) - size, statistic.gaits)
    rest.gram = statistic.gram[np.ix_(kept, kept)]
    rest.right = (statistic.right - statistic.gram @ taken)[kept]
    rest.square = statistic.square + float(taken @ (statistic.gram @ taken - 2 * statistic.right))
    rest.count = statistic.count
    return rest
