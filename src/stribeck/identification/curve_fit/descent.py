"""One descent to a minimum of the sum of squares, in coordinates that suit it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from stribeck.identification.curve_fit.problem import FitProblem
from stribeck.identification.curve_fit.robust import Loss
from stribeck.typing import Array

ROUGH, FINE = 1e-6, 1e-9
"""Relative change of cost and parameters [1] that ends a descent on the subset, and the last one."""

EVALUATIONS = 100
"""Evaluations [1] after which a descent gives up; one that is well determined needs about ten."""


@dataclass(frozen=True, eq=False)
class Descent:
    """Where a descent ended: values, cost, the parameters at a bound, and whether it converged."""

    values: Array
    cost: float
    at_bound: NDArray[np.bool_]
    converged: bool


def descend(
    problem: FitProblem, start: Array, loss: Loss = "linear", loss_scale: float = 0.0, tolerance: float = FINE
) -> Descent:
    """Minimise (6.4) by SciPy's trust-region-reflective algorithm, scales by their logarithm."""
    logs = problem.logarithmic
    # residuals of order one, whatever the joint's torque: SciPy's gradient tolerance is absolute
    scale = max(float(np.sqrt(np.mean(problem.friction_torque**2))), 1e-30) * np.sqrt(len(problem.velocity))
    bounds = problem.bounds
    lower, upper = to_internal(bounds[:, 0], logs), to_internal(bounds[:, 1], logs)

    def residual(u: Array) -> Array:
        return np.asarray((problem.predict(to_external(u, logs)) - problem.friction_torque) / scale)

    def jacobian(u: Array) -> Array:
        return np.asarray(internal_jacobian(problem, to_external(u, logs)) / scale)

    solution = least_squares(
        residual,
        np.clip(to_internal(start, logs), lower, upper),
        jac=jacobian,
        bounds=(lower, upper),
        method="trf",
        x_scale="jac",
        loss=loss,
        f_scale=loss_scale / scale if loss_scale else 1.0,
        ftol=tolerance,
        xtol=tolerance,
        gtol=tolerance**1.5,
        max_nfev=EVALUATIONS,
    )
    at_bound = solution.active_mask != 0
    ended = np.where(at_bound, np.where(solution.active_mask < 0, lower, upper), solution.x)  # SciPy stops just short
    values = np.clip(to_external(ended, logs), bounds[:, 0], bounds[:, 1])  # a logarithm's way there and back rounds
    return Descent(values, float(solution.cost * scale**2), at_bound, solution.status > 0)


def to_internal(values: Array, logarithmic: NDArray[np.bool_]) -> Array:
    """Return the coordinates of a descent, shape (..., p): logarithms of scales, other values as they are."""
    return np.where(logarithmic, np.log(np.where(logarithmic, values, 1.0)), values)


def to_external(internal: Array, logarithmic: NDArray[np.bool_]) -> Array:
    """Return the parameter values, shape (..., p), of a descent's coordinates."""
    return np.where(logarithmic, np.exp(np.where(logarithmic, internal, 0.0)), internal)


def internal_jacobian(problem: FitProblem, values: Array) -> Array:
    """Return the derivatives by the logarithms, dR/d(ln p) = p dR/dp, of the parameters that are scales."""
    return problem.jacobian(values) * np.where(problem.logarithmic, values, 1.0)
