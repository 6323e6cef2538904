"""Fits many joints' curves at once, each to its own quadratic: the same descent as `solve`, all else being fixed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.profile import Quadratic
from stribeck.typing import Array

SETTLED = 1e-3
"""Decrease of chi^2 [1] that ends a descent; scores are told apart by units."""

ITERATIONS = 100
"""Steps [1] that are tried before it gives up."""

STEEPEST = 1e8
"""Damping [1] from which no step is worth trying."""


def descend_joints(logs: Sequence[Quadratic], curves: Curves, start: Array) -> tuple[Array, Array]:
    """Return where damped Gauss-Newton descents end, shape (n, p), and chi^2 there but for a constant, shape (n,).

    Parameters
    ----------
    logs
        What n logs, or one log n times, say of the coefficients of a joint's curves.
    curves
        Those of n joints, some of whose parameters may be fixed; a joint may be there more than once.
    start
        Internal coordinates, shape (n, p).
    """
    gram, right = _stacked(logs)
    ends, lowest = np.empty(start.shape), np.empty(len(start))
    low, high = (np.broadcast_to(bound, start.shape) for bound in curves.bounds)
    left, x, damping = np.arange(len(start)), np.clip(start, low, high), np.full(len(start), 1e-3)
    cost, diagonal = _costs(gram, right, curves, x), np.arange(start.shape[1])
    for _ in range(ITERATIONS):
        mean, spread = curves.prior()
        slopes = curves.jacobians(x)
        pull = _times(gram, curves.coefficients(x).reshape(right.shape)) - right
        gradient = _times(slopes.transpose(0, 2, 1), pull) + (x - mean) / spread**2
        hessian = slopes.transpose(0, 2, 1) @ gram @ slopes
        hessian[:, diagonal, diagonal] += spread**-2
        free = (low < high) & ~((x <= low) & (gradient > 0)) & ~((x >= high) & (gradient < 0))
        hessian *= free[:, :, None] & free[:, None]
        scale = np.where(free, hessian[:, diagonal, diagonal], 1.0)
        hessian[:, diagonal, diagonal] = scale * (1 + damping[:, None])
        step = np.linalg.solve(hessian, np.where(free, gradient, 0.0)[:, :, None])[:, :, 0]
        tried = np.clip(x - step, low, high)
        there = _costs(gram, right, curves, tried)
        gain = cost - there
        better = gain > 0
        x[better], cost[better] = tried[better], there[better]
        ends[left], lowest[left] = x, cost
        damping = np.where(better, np.maximum(damping / 8, 1e-9), 8 * damping)
        going = np.flatnonzero((damping < STEEPEST) & ~(better & (gain < SETTLED)))
        if not len(going):
            break
        if len(going) < len(left):
            left = left[going]
            x, cost, damping, low, high = (each[going] for each in (x, cost, damping, low, high))
            gram, right, curves = gram[going], right[going], curves.of(going)
    return ends, lowest


def joint_costs(logs: Sequence[Quadratic], curves: Curves, internal: Array) -> Array:
    """Return chi^2 but for a constant at internal coordinates, shape (n, p) -> (n,), the prior's share included."""
    return _costs(*_stacked(logs), curves, internal)


def _stacked(logs: Sequence[Quadratic]) -> tuple[Array, Array]:
    return np.stack([log.gram for log in logs]), np.stack([log.right for log in logs])


def _costs(gram: Array, right: Array, curves: Curves, internal: Array) -> Array:
    mean, spread = curves.prior()
    values = curves.coefficients(internal).reshape(right.shape)
    squares = np.sum(values * (_times(gram, values) - 2 * right), axis=1)
    return np.asarray(squares + np.sum(((internal - mean) / spread) ** 2, axis=1))


def _times(matrices: Array, vectors: Array) -> Array:
    """Return the product of each matrix, shape (n, a, b), and its vector, shape (n, b), shape (n, a)."""
    return np.asarray((matrices @ vectors[:, :, None])[:, :, 0])
