"""Gauss-Newton with damping on the summed-up log: all joints and corrections at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.model import ModelCorrections
from stribeck.identification.whole_log.statistic import Statistic
from stribeck.typing import Array

SETTLED = 1e-7
"""Decrease of chi^2 [1] per unit of it that ends the descent."""

ITERATIONS = 60
"""Steps [1] after which a descent gives up; about ten are needed."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Solution:
    """Where the descent ended.

    Attributes
    ----------
    internal
        Coordinates of the law's parameters, shape (n, p).
    corrections
        Coordinates of the model's corrections, shape (c,).
    covariance
        Of all coordinates, joints first, shape (n p + c, n p + c).
    held
        Which parameters a bound holds, shape (n, p).
    chi_square
        Without the prior's share.
    cost
        Half of chi_square plus the prior's share.
    settled
        Whether the descent came to its end.
    """

    internal: Array
    corrections: Array
    covariance: Array
    held: NDArray[np.bool_]
    chi_square: float
    cost: float
    settled: bool


@dataclass(frozen=True, eq=False)
class _Point:
    """Everything at one set of coordinates: cost, gradient, curvature."""

    cost: float
    chi_square: float
    gradient: Array
    hessian: Array


def solve(statistic: Statistic, curves: Curves, model: ModelCorrections, before: Solution | None = None) -> Solution:
    """Return the best of two descents, or the descent from a solution of nearly the same problem.

    Parameters
    ----------
    statistic
        The log.
    curves
        The law.
    model
        Coordinates of the corrections, and what is believed of them.
    before
        Where to start; two uniform starts if None.
    """
    if before is not None:
        return _descend(statistic, curves, model, before.internal, before.corrections)
    size = statistic.nodes.size
    gram, right = statistic.gram[:size, :size], statistic.right[:size]
    starts = [curves.linear_start(shapes, gram, right) for shapes in curves.shapes()]
    nothing = np.zeros(statistic.corrections)
    return min((_descend(statistic, curves, model, start, nothing) for start in starts), key=lambda found: found.cost)


def curvature(statistic: Statistic, curves: Curves, model: ModelCorrections, at: Solution) -> Array:
    """Return Gauss-Newton's second derivatives of half of chi^2 at a solution, the prior's included."""
    return derivatives(statistic, curves, model, at)[1]


def derivatives(statistic: Statistic, curves: Curves, model: ModelCorrections, at: Solution) -> tuple[Array, Array]:
    """Return gradient and curvature of half of chi^2 at a solution, the prior's included."""
    x = np.concatenate([at.internal.ravel(), at.corrections])
    found = _evaluate(statistic, curves, model, x, at.internal.shape)
    return found.gradient, found.hessian


def _descend(statistic: Statistic, curves: Curves, model: ModelCorrections, start: Array, known: Array) -> Solution:
    shape = start.shape
    corrections = statistic.corrections
    low, high = (
        np.concatenate([np.broadcast_to(bound, shape).ravel(), np.full(corrections, end)])
        for bound, end in zip(curves.bounds, (-np.inf, np.inf), strict=True)
    )
    x = np.concatenate([start.ravel(), known])
    here = _evaluate(statistic, curves, model, x, shape)
    damping, settled = 1e-3, False
    for _ in range(ITERATIONS):
        held = ((x <= low) & (here.gradient > 0)) | ((x >= high) & (here.gradient < 0))
        step = _step(here, held, damping)
        tried = np.clip(x + step, low, high)
        there = _evaluate(statistic, curves, model, tried, shape)
        if not there.cost < here.cost:
            damping *= 8
            if damping > 1e8:
                settled = True
                break
            continue
        gain = here.cost - there.cost
        x, here, damping = tried, there, max(damping / 8, 1e-9)
        if gain < SETTLED * here.cost:
            settled = True
            break
    held = ((x <= low) & (here.gradient > 0)) | ((x >= high) & (here.gradient < 0))
    return Solution(
        internal=x[: start.size].reshape(shape),
        corrections=x[start.size :],
        covariance=inverse_of(here.hessian),
        held=held[: start.size].reshape(shape),
        chi_square=here.chi_square,
        cost=here.cost,
        settled=settled,
    )


def _step(here: _Point, held: NDArray[np.bool_], damping: float) -> Array:
    """Return the damped Newton step of the coordinates that no bound holds."""
    free = np.flatnonzero(~held)
    matrix = here.hessian[np.ix_(free, free)]
    scale = np.diag(matrix)
    step = np.zeros(len(held))
    step[free] = -cho_solve(cho_factor(matrix + damping * np.diag(scale)), here.gradient[free])
    return step


def inverse_of(matrix: Array) -> Array:
    """Return the inverse of a positive definite matrix whose rows may be of very different units."""
    scale = 1 / np.sqrt(np.diag(matrix))
    scaled = matrix * np.outer(scale, scale)
    return np.asarray(cho_solve(cho_factor(scaled), np.eye(len(matrix))) * np.outer(scale, scale))


def _evaluate(
    statistic: Statistic, curves: Curves, model: ModelCorrections, x: Array, shape: tuple[int, ...]
) -> _Point:
    """Return cost, gradient and Gauss-Newton's curvature at coordinates, joints first, then corrections."""
    joints, count = shape
    friction = joints * count
    internal, corrections = x[:friction].reshape(shape), x[friction:]
    corrected, slopes = model.values(corrections)
    values = np.concatenate([curves.coefficients(internal), corrected])
    jacobians = curves.jacobians(internal)
    pull = statistic.gram @ values
    chi_square = statistic.square + float(values @ (pull - 2 * statistic.right))
    slope = pull - statistic.right
    half = times_jacobian(statistic.gram, jacobians, slopes, model.scales)
    hessian = times_jacobian(half.T, jacobians, slopes, model.scales).T
    gradient = times_jacobian(slope[None], jacobians, slopes, model.scales)[0]
    mean, spread = curves.prior()
    off = (internal - mean) / spread
    gradient[:friction] += (off / spread).ravel()
    hessian[np.arange(friction), np.arange(friction)] += (spread**-2).ravel()
    drawn = model.precision @ corrections
    gradient[friction:] += drawn
    hessian[friction:, friction:] += model.precision
    believed = float(np.sum(off**2) + corrections @ drawn)
    return _Point(0.5 * (chi_square + believed), chi_square, gradient, hessian)


def times_jacobian(matrix: Array, curves: Array, bodies: Array, scales: Array) -> Array:
    """Return a matrix, shape (r, D), times the derivatives by all coordinates, which are block-diagonal.

    Blocks: one a joint, shape (n, r, p), one a body, shape (L, 10, 10), and a number for each other correction.
    """
    columns, parts = 0, []
    for blocks in (curves, bodies):
        size = blocks.shape[0] * blocks.shape[1]
        cut = matrix[:, columns : columns + size].reshape(len(matrix), *blocks.shape[:2])
        product = cut.transpose(1, 0, 2) @ blocks
        parts.append(product.transpose(1, 0, 2).reshape(len(matrix), -1))
        columns += size
    return np.hstack([*parts, matrix[:, columns:] * scales])
