"""Friction torque that a law predicts for the samples of a joint, averaged as by the filter of the torque."""

from collections.abc import Callable, Mapping
from typing import Any, cast

import numpy as np

from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.friction import LawWithState
from stribeck.core.judgement.curve_fit.problem import FitProblem


def predict(problem: FitProblem, values: Array) -> Array:
    """Compute the torque [N m] for parameter values, shape (p,) -> (N,)."""
    if problem.acceleration is None:
        return _of_law(problem, "torque", values)
    return np.asarray(_of_law(problem, "torque", values[:-1]) + values[-1] * problem.acceleration)


def jacobian(problem: FitProblem, values: Array) -> Array:
    """Compute the derivatives of `predict`, shape (N, p)."""
    if problem.acceleration is None:
        return _of_law(problem, "jacobian", values)
    return np.column_stack([_of_law(problem, "jacobian", values[:-1]), problem.acceleration])


def internal_jacobian(problem: FitProblem, values: Array) -> Array:
    """Compute the derivatives in internal coordinates, dR/d(ln p) = p dR/dp for scales, shape (N, p)."""
    return jacobian(problem, values) * np.where(logarithmic(problem), values, 1.0)


def logarithmic(problem: FitProblem) -> BoolArray:
    """Find the parameters that are fitted in their logarithm, shape (p,)."""
    return np.array([parameter.logarithmic for parameter in problem.parameters])


def filtered_basis(problem: FitProblem, shape: Mapping[str, float]) -> Array:
    """Compute the filtered basis of the law for given nonlinear parameters, shape (N, k)."""
    return _of_law(problem, "basis", shape)


def _of_law(problem: FitProblem, kind: str, values: Any) -> Array:
    """Compute the `torque` or `jacobian` of the law at values, or its `basis` for a shape, filtered."""
    if problem.along is not None and isinstance(problem.law, LawWithState):
        return problem.along.average(getattr(problem.law, f"{kind}_along")(problem.along.motion, values))
    return _average(problem, lambda velocity: cast(Array, getattr(problem.law, kind)(velocity, values)))


def _average(problem: FitProblem, function: Callable[[Array], Array]) -> Array:
    """Average a function of the velocity, shape (M,) -> (M, ...), with the filter's weights, shape (N, ...)."""
    result, turning = function(problem.velocity), problem.turning
    if len(turning) and problem.around is not None and problem.weights is not None:
        around = problem.around[turning]
        values = function(around.ravel()).reshape(*around.shape, -1)
        result[turning] = np.einsum("nkp,k->np", values, problem.weights).reshape(-1, *result.shape[1:])
    return result
