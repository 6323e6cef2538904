"""Fits one joint's curves to its own quadratic: the same descent as `solve`, without what one joint does not need."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.profile import Quadratic
from stribeck.log import Array

SETTLED = 1e-3
"""Decrease of chi^2 [1] that ends a descent; scores are told apart by units."""

ITERATIONS = 60
"""Steps [1] after which it gives up."""


@dataclass(frozen=True, eq=False)
class JointSolution:
    """Internal coordinates, shape (1, p), and chi^2 but for a constant, the prior's share included."""

    internal: Array
    cost: float


def descend_joint(log: Quadratic, curves: Curves, start: Array) -> JointSolution:
    """Return where a damped Gauss-Newton descent from internal coordinates, shape (1, p), ends.

    `curves` are those of the joint, some of whose parameters may be fixed.
    """
    low, high = (np.broadcast_to(bound, start.shape)[0] for bound in curves.bounds)
    mean, spread = (part[0] for part in curves.prior())
    x, damping = np.clip(start[0], low, high), 1e-3
    cost = joint_cost(log, curves, x[None])
    for _ in range(ITERATIONS):
        slopes = curves.jacobians(x[None])[0]
        pull = log.gram @ curves.coefficients(x[None]) - log.right
        gradient = slopes.T @ pull + (x - mean) / spread**2
        hessian = slopes.T @ log.gram @ slopes + np.diag(spread**-2)
        free = (low < high) & ~((x <= low) & (gradient > 0)) & ~((x >= high) & (gradient < 0))
        matrix, scale = hessian[np.ix_(free, free)], np.diag(np.diag(hessian)[free])
        gain = 0.0
        while damping < 1e8:
            tried = x.copy()
            tried[free] -= np.linalg.solve(matrix + damping * scale, gradient[free])
            tried = np.clip(tried, low, high)
            gain = cost - joint_cost(log, curves, tried[None])
            if gain > 0:
                x, cost, damping = tried, cost - gain, max(damping / 8, 1e-9)
                break
            damping *= 8
        if gain < SETTLED:
            break
    return JointSolution(x[None], cost)


def joint_cost(log: Quadratic, curves: Curves, internal: Array) -> float:
    """Return chi^2 but for a constant at internal coordinates, shape (1, p), the prior's share included."""
    mean, spread = curves.prior()
    return log.at(curves.coefficients(internal)) + float(np.sum(((internal - mean) / spread) ** 2))
