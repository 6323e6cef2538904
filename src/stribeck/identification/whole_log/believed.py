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

from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.model import ModelCorrections
from stribeck.identification.whole_log.solve import Solution, solve
from stribeck.identification.whole_log.statistic import Statistic
from stribeck.log import Array
from stribeck.pseudo_inertia import SIZE

DOUBT = 0.1
"""How many estimates the first belief is worth [1]: what the log does not determine stays as it was."""

DOUBT_OF_MODEL = 0.01
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
    """Return curves and model with what the log says of them beforehand, and the solution with that."""
    solution = solve(statistic, curves, model, before)
    for _ in range(ROUNDS):
        curves, model = _learn_alike(curves, solution), _learn_spread(model, solution)
        solution = solve(statistic, curves, model, solution)
    return curves, model, solution


def _learn_alike(curves: Curves, solution: Solution) -> Curves:
    joints, count = solution.internal.shape
    variance = np.diag(solution.covariance)[: joints * count].reshape(joints, count)
    free = np.stack([curves.has(joint) for joint in range(joints)])
    mean, spread = curves.prior()
    alike = np.full((2, count), np.nan)
    for k in curves.shared:
        own = free[:, k]
        if not own.any():
            continue
        known = (1 - variance[own, k] / spread[own, k] ** 2).clip(0, 1)
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
