"""What is believed beforehand, measured from the log itself: how alike joints are, and how wrong the model is.

A prior's standard deviation s is that under which the log is most likely: with estimates x of covariance C,

    s^2 = sum x^2 / sum (1 - C / s^2)

where the right sum counts how many of them the log determines (MacKay 1992). So a model that is right is believed to be
right, a wrong one as wrong as it shows, and the bends of the friction curves, which hardly any joint shows well, are
alike in all joints as far as the joints that show them are.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.model import ModelCorrections
from stribeck.identification.whole_log.restarts import with_restarts
from stribeck.identification.whole_log.solve import Solution, solve
from stribeck.identification.whole_log.statistic import Statistic
from stribeck.inertial_parameters import SIZE
from stribeck.typing import Array

DOUBT = 0.03
"""How many estimates the first belief is worth [1]: what the log does not determine stays as it was."""

DOUBT_OF_MODEL = 0.001
"""The same of how wrong model and sensors are, of which a log tells more; offsets are as good as what is believed.

With as much as `DOUBT`, an exact model is still believed to be off.
"""

MOST = 1.0
"""Of the errors of model and sensors [1] over what they are usually wrong by.

A log with errors of other kinds would have bodies explain them, and more so with every round.
"""

ALIKE = 0.5
"""How much joints differ in the nonlinear parameters and pure numbers of their law [1], before the log speaks."""

ROUNDS = 4
"""Of measuring [1]; each needs a fit of its own."""


def solve_and_believe(
    statistic: Statistic, curves: Curves, model: ModelCorrections, before: Solution
) -> tuple[Curves, ModelCorrections, Solution]:
    """Return curves and model with what the log says of them beforehand, and the solution with that.

    Once joints are known to be alike, one that is far from the others may turn out to be in a dip that was as good as
    theirs as long as it stood alone: all try their other starts.
    """
    solution = solve(statistic, curves, model, before)
    for _ in range(ROUNDS):
        alone = curves.alike is None
        curves, model = _learn_alike(curves, solution), _learn_spread(model, solution)
        solution = solve(statistic, curves, model, solution)
        if alone:
            solution = with_restarts(statistic, curves, model, solution)
    return curves, model, solution


def by_what_is_common(curves: Curves, solution: Solution) -> Array:
    """Return what to add to a solution's covariance, as what joints have in common is not known for certain either.

    With s the standard deviation of a coordinate over the joints, of which the log determines N, their mean has the
    variance s^2 / N, and all coordinates follow it by the sum of C / s^2 over the joints, C being the solution's
    covariance (Kass and Steffey 1989).
    """
    assert curves.alike is not None  # measured beforehand
    added = np.zeros_like(solution.covariance)
    for k in np.flatnonzero(np.isfinite(curves.alike[1])).tolist():
        own, known = _determined(curves, solution, k)
        variance = curves.alike[1, k] ** 2
        follow = solution.covariance[:, own * solution.internal.shape[1] + k].sum(axis=1) / variance
        added += np.outer(follow, follow) * variance / (known.sum() + DOUBT)
    return added


def _determined(curves: Curves, solution: Solution, parameter: int) -> tuple[NDArray[np.int64], Array]:
    """Return the joints that have a parameter, shape (m,), and how much of each the log determines, from 0 to 1."""
    joints, count = solution.internal.shape
    own = np.array([joint for joint in range(joints) if curves.has(joint)[parameter]], dtype=np.int64)
    variance = np.diag(solution.covariance)[own * count + parameter]
    return own, (1 - variance / curves.prior()[1][own, parameter] ** 2).clip(0, 1)


def _learn_alike(curves: Curves, solution: Solution) -> Curves:
    mean, alike = curves.prior()[0], np.full((2, solution.internal.shape[1]), np.nan)
    for k in curves.shared:
        own, known = _determined(curves, solution, k)
        if not len(own):
            continue
        off = solution.internal[own, k] - mean[own, k]
        total = known.sum() + DOUBT
        middle = (np.sum(known * mean[own, k] + off) + DOUBT * mean[own, k].mean()) / total
        squares = np.sum((off + known * (mean[own, k] - middle)) ** 2)
        beside = max(known.sum() - 1, 0.0) + DOUBT  # one of them has gone into the middle
        alike[:, k] = middle, np.sqrt((squares + DOUBT * ALIKE**2) / beside)
    return replace(curves, alike=alike)


def _learn_spread(model: ModelCorrections, solution: Solution) -> ModelCorrections:
    variance = np.diag(solution.covariance)[solution.internal.size :]
    spread = model.spread.copy()
    for group in _groups(model):
        known = (1 - model.doubt * variance[group] / spread[group] ** 2).clip(0, 1).sum()
        square = np.sum(solution.corrections[group] ** 2)
        spread[group] = min(np.sqrt((square + DOUBT_OF_MODEL) / (known + DOUBT_OF_MODEL)), MOST)
    return replace(model, spread=spread)


def _groups(model: ModelCorrections) -> Iterator[Array]:
    """Yield the coordinates that are wrong alike: masses, centres, moments, gains, zeros, tilts."""
    there = model.corrections
    inertial = np.arange(there.inertial_parameters.size).reshape(-1, SIZE)
    first = there.inertial_parameters.size
    ends = first + np.cumsum([0, there.gains, there.zeros, there.tilts])
    calibration = [np.arange(low, high) for low, high in pairwise(ends)]
    for group in (inertial[:, 0], inertial[:, 1:4].ravel(), inertial[:, 4:].ravel(), *calibration):
        if len(group):
            yield group
