"""Intervals from the log's own steps: how parameters would vary over logs of other such steps.

A log that might have been recorded is made of this one's stretches, drawn with replacement. With g_s and H_s the
gradient and curvature of a stretch s at the solution, w_s how often it was drawn, and P the curvature of the priors,
one step of Gauss-Newton goes from the solution to that of such a log:

    -(sum w_s H_s + P)^-1 (sum (w_s - 1) g_s + e),    e of covariance P

Priors are drawn anew too: a parameter that no stretch knows about stays as uncertain as it was believed to be.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.levels import ErrorLevels
from stribeck.identification.whole_log.model import ModelCorrections
from stribeck.identification.whole_log.solve import Solution, derivatives
from stribeck.identification.whole_log.statistic import Statistic
from stribeck.identification.whole_log.summing import sum_up
from stribeck.typing import Array
from stribeck.weak_equations import WeakEquations

GROUPS = 48
"""Most that are drawn from [1], as many curvatures as fit in memory; neighbours in longer logs are drawn together."""

REPLICATES = 300
"""Logs that are drawn [1]: standard errors are known to 4 %."""

SEED = 7
"""Of the draws: the same log has the same intervals."""


def bootstrap_covariance(
    equations: Sequence[WeakEquations], levels: ErrorLevels, curves: Curves, model: ModelCorrections, solution: Solution
) -> Array:
    """Return the covariance of all coordinates, joints first, over logs drawn from a log's stretches.

    Parameters
    ----------
    equations
        Of all stretches.
    levels, curves, model, solution
        Of the whole log.
    """
    believed, prior = derivatives(Statistic(curves.nodes, model.size), curves, model, solution)
    places = np.array_split(np.arange(len(equations)), min(GROUPS, len(equations)))
    gradients, curvatures = np.empty((len(places), len(prior))), np.empty((len(places), *prior.shape))
    for k, group in enumerate(places):
        part = sum_up(equations, levels, curves, model, places=group.tolist())
        gradient, curvature = derivatives(part, curves, model, solution)
        gradients[k], curvatures[k] = gradient - believed, curvature - prior
    generator = np.random.default_rng(SEED)
    spread, count = np.linalg.cholesky(prior), len(places)
    steps = np.empty((REPLICATES, len(prior)))
    for step in steps:
        drawn = np.bincount(generator.integers(count, size=count), minlength=count)
        pull = (drawn - 1) @ gradients + spread @ generator.standard_normal(len(prior))
        total = prior + np.tensordot(drawn, curvatures, axes=1)
        scale = 1 / np.sqrt(np.diag(total))
        step[:] = scale * cho_solve(cho_factor(total * np.outer(scale, scale)), scale * pull)
    return np.asarray(np.cov(steps, rowvar=False)) * count / max(count - 1, 1)
