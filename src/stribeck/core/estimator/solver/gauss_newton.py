"""Damped Gauss-Newton within bounds, several descents at once (docs/estimator-fit.md, equation 20).

With the gradient g of a cost and Gauss-Newton's matrix H of its second derivatives, a step goes from x to

    clip(x - (H + lambda diag H)^-1 g)

in all coordinates that are not held at a bound (Levenberg 1944; Marquardt 1963; bounds: Bertsekas 1982). The damping
lambda decreases to an eighth if the cost decreases, and otherwise grows by the same factor, at least to its first
value. All constants are chosen by judgment.
"""

from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.core.equations.constants import CONVERGED

ROUNDING = 1e-13
"""Rounding error of a cost relative to it [1]: steps of less are no progress, however exact a log is."""


class Problem(Protocol):
    """Costs of b descents in m coordinates each."""

    def costs(self, x: Array) -> Array:
        """Compute the cost of each descent, shape (b, m) -> (b,)."""

    def derivatives(self, x: Array) -> tuple[Array, Array]:
        """Compute gradients, shape (b, m), and second derivatives, shape (b, m, m)."""

    def of(self, rows: NDArray[np.int64]) -> Self:
        """Select some of the descents."""


@dataclass(frozen=True, eq=False)
class Minimum:
    """Ends of b descents, shape (b, m), costs there, and convergence of each, shape (b,)."""

    x: Array
    cost: Array
    converged: NDArray[np.bool_]


def minimise(problem: Problem, start: Array, low: Array, high: Array, tolerance: float = CONVERGED) -> Minimum:
    """Run descents from `start`, shape (b, m), between bounds of the same shape.

    A descent ends after a step that changes its cost by less than `tolerance`.
    """
    x, first = np.clip(start, low, high), 1e-3
    cost, damping = problem.costs(x), np.full(len(x), first)
    converged, going, subproblem, known = np.zeros(len(x), dtype=bool), np.arange(len(x)), problem, None
    for _ in range(100):
        gradient, hessian = known = known or subproblem.derivatives(x[going])
        free = ~bounds_hold(x[going], gradient, low[going], high[going])
        step = _steps(gradient, hessian, free, damping[going])
        tried = np.clip(x[going] - step, low[going], high[going])
        with np.errstate(over="ignore", invalid="ignore"):  # infinity and NaN after a long step are never better
            after = subproblem.costs(tried)
        gain = cost[going] - after
        better = gain > 0
        x[going[better]], cost[going[better]] = tried[better], after[better]
        known = None if better.any() else known
        damping[going] = np.where(better, np.maximum(damping[going] / 8, 1e-9), np.maximum(damping[going] * 8, first))
        least = np.maximum(tolerance, ROUNDING * np.abs(cost[going]))
        converged[going] = (np.abs(gain) < least) | (damping[going] > 1e8)  # no step decreases the cost
        if converged[going].any():
            going = np.flatnonzero(~converged)
            if not len(going):
                break
            subproblem, known = problem.of(going), None
    return Minimum(x, cost, converged)


def bounds_hold(x: Array, gradient: Array, low: Array, high: Array) -> NDArray[np.bool_]:
    """Find coordinates at a bound, which are fixed or have a gradient that points outward."""
    return np.asarray((low >= high) | ((x <= low) & (gradient > 0)) | ((x >= high) & (gradient < 0)))


def _steps(gradient: Array, hessian: Array, free: NDArray[np.bool_], damping: Array) -> Array:
    """Compute damped Newton steps of the free coordinates, shape (b, m); scaled rows allow different units."""
    if len(gradient) == 1 and not free.all():  # skip fixed coordinates to save time
        mask = free[0]
        step = np.zeros_like(gradient)
        step[:, mask] = _steps(gradient[:, mask], hessian[:, mask][:, :, mask], free[:, mask], damping)
        return step
    diagonal = np.arange(hessian.shape[1])
    free = free & (hessian[:, diagonal, diagonal] > 0)  # rounding may make undetermined coordinates concave
    scale = np.where(free, 1 / np.sqrt(np.where(free, hessian[:, diagonal, diagonal], 1.0)), 0.0)
    matrix = hessian * scale[:, :, None] * scale[:, None]
    matrix[:, diagonal, diagonal] = 1 + damping[:, None]
    return np.asarray(scale * np.linalg.solve(matrix, (scale * gradient)[:, :, None])[:, :, 0])
