"""Where fits start: a grid over the nonlinear parameters, the linear ones eliminated."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import cast

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import nnls

from stribeck.friction import FrictionLaw
from stribeck.identification.curve_fit.problem import FitProblem
from stribeck.identification.judgement.speed import top_speed
from stribeck.typing import Array


def grid_starts(problem: FitProblem) -> list[tuple[float, Array]]:
    """Return (sum of squared residuals, values (p,)) of every grid point, best first."""
    speed = max(top_speed(problem.velocity), 1e-6)
    starts = [eliminate_linear(problem, shape) for shape in shapes_of(problem.law, speed)]
    return sorted(starts, key=lambda start: start[0])


def shapes_of(law: FrictionLaw, speed: float) -> Iterator[dict[str, float]]:
    """Yield all sets of nonlinear parameters to start from, of a joint with a top speed [rad/s]."""
    nonlinear = [parameter for parameter in law.parameters if parameter.starts]
    axes = [np.clip(np.array(p.starts) * speed**p.start_speed_power, p.lower, p.upper).tolist() for p in nonlinear]
    for point in itertools.product(*axes):
        yield dict(zip((parameter.name for parameter in nonlinear), point, strict=True))


def eliminate_linear(problem: FitProblem, shape: dict[str, float]) -> tuple[float, Array]:
    """Return (sum of squared residuals, values (p,)) of the best linear parameters for given nonlinear ones.

    Bounded linear least squares: free columns (an offset) come first, so that the triangular factor leaves a
    problem of non-negative coefficients alone.
    """
    basis = problem.basis(shape)
    if problem.acceleration is not None:
        basis = np.column_stack([basis, problem.acceleration])
    columns = basis.shape[1]
    free = list(problem.law.free_coefficients)
    order = free + [column for column in range(columns) if column not in free]
    # rows of zeros keep the factor square where there are fewer samples than columns
    stacked = np.vstack([np.column_stack([basis[:, order], problem.friction_torque]), np.zeros((columns + 1,) * 2)])
    factor = cast("Array", np.linalg.qr(stacked, mode="r"))
    R, y, k = factor[:-1, :-1], factor[:-1, -1], len(free)
    ordered = np.zeros(columns)
    ordered[k:], rest = nnls(R[k:, k:], y[k:])
    ordered[:k] = solve_triangular(R[:k, :k], y[:k] - R[:k, k:] @ ordered[k:])
    coefficients = np.zeros(columns)
    coefficients[order] = ordered
    linear = coefficients if problem.acceleration is None else coefficients[:-1]
    values = problem.law.from_linear(linear, shape)
    if problem.acceleration is not None:
        values = np.append(values, coefficients[-1])
    return float(rest**2 + factor[-1, -1] ** 2), values
