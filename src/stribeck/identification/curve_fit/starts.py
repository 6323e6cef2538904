"""Where fits start: a grid over the nonlinear parameters, the linear ones eliminated."""

import itertools
from collections.abc import Iterator
from typing import cast

import numpy as np
from scipy.optimize import lsq_linear

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

    Bounded linear least squares of the triangular factor; free columns (an offset) may be negative.
    """
    basis = problem.basis(shape)
    if problem.acceleration is not None:
        basis = np.column_stack([basis, problem.acceleration])
    columns = basis.shape[1]
    # rows of zeros keep the factor square where there are fewer samples than columns
    stacked = np.vstack([np.column_stack([basis, problem.friction_torque]), np.zeros((columns + 1,) * 2)])
    factor = cast("Array", np.linalg.qr(stacked, mode="r"))
    lower = np.where(np.isin(np.arange(columns), problem.law.free_coefficients), -np.inf, 0.0)
    found = lsq_linear(factor[:-1, :-1], factor[:-1, -1], (lower, np.inf), method="bvls")
    fitted = None if problem.acceleration is None else -1
    values = np.append(problem.law.from_linear(found.x[:fitted], shape), [] if fitted is None else found.x[-1])
    return float(2 * found.cost + factor[-1, -1] ** 2), values
