"""What errors that come back with every step do to the intervals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stribeck.identification.whole_log.cosines import COSINES
from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.model import ModelCorrections
from stribeck.identification.whole_log.solve import Solution, curvature, solve
from stribeck.identification.whole_log.statistic import Statistic
from stribeck.log import Array

FIRST, LEAST = 0.01, 1e-4
"""Standard deviation of the repeated torques to begin with, and the least [N m]."""

ROUNDS = 3
"""How often it is measured [1]."""


def spread_of_repeated(
    statistic: Statistic, curves: Curves, model: ModelCorrections, solution: Solution
) -> tuple[Array, Array]:
    """Return the repeated torques' standard deviation in each joint [N m], shape (n,), and the solution's covariance.

    With A the curvature, Z the repeated torques' columns and Q their variances, an estimate that leaves them out has

        A^-1 + A^-1 (J^T Sigma^-1 Z) Q (J^T Sigma^-1 Z)^T A^-1

    Q is measured by fits that have these torques: each variance is their sum of squares over how many of them the log
    determines (MacKay 1992).
    """
    joints = len(model.repeated)
    if not model.gaits:
        return np.zeros(joints), solution.covariance
    friction, columns = solution.internal.size, model.gaits * COSINES * joints
    tried, free = replace(model, repeated=np.full(joints, FIRST)), solution
    for _ in range(ROUNDS):
        free = solve(statistic, curves, tried, replace(free, corrections=solution.corrections))
        own = slice(friction + model.corrections.size, None)
        square = (free.corrections[-columns:] ** 2).reshape(-1, joints).sum(axis=0)
        known = (1 - np.diag(free.covariance)[own]).reshape(-1, joints).sum(axis=0)  # how many the log determines
        growth = np.sqrt(square / np.maximum(known, 1.0))
        tried = replace(tried, repeated=np.maximum(tried.repeated * growth, LEAST))
    cross = curvature(statistic, curves, tried, solution)[:, -columns:]
    cross[-columns:] = 0
    bias = solution.covariance @ cross
    return tried.repeated, solution.covariance + bias @ bias.T
