"""Least squares over physically possible bodies, and base parameters (docs/other-methods.md).

The entropic divergence of a body's pseudo-inertia P from the model's pseudo-inertia P_0,

    d(P, P_0) = tr(P_0^-1 P) - log det(P_0^-1 P) - 4

is convex, independent of the frame, and infinite at the boundary of positive definite P. The minimum of a sum of
squares and the divergence is therefore unique and physically consistent (Lee, Wensing and Park 2020).
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve, qr

from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.robot.inertial_parameters import SIZE, pseudo_inertia

BASIS = pseudo_inertia(np.eye(SIZE))
"""Derivatives of the pseudo-inertia with respect to the ten parameters, shape (10, 4, 4)."""


class ConsistentFit(NamedTuple):
    """Parameters (L, 10), friction coefficients (q,), mask of coefficients at zero, and Hessian of the penalty."""

    parameters: Array
    coefficients: Array
    held: BoolArray
    hessian: Array


def base_parameters(regressor: Array) -> tuple[IntArray, float]:
    """Find the independent columns of a regressor (N, p), by QR with column pivoting (Gautier 1991).

    For columns of norm 1, those that depend on each other by the structure of the robot have diagonal entries of at
    most 1e-12 in the triangular factor, and those that the motion hardly excites above 1e-5.

    Returns
    -------
    columns, condition
        Indices of the columns, shape (b,), and their condition number at norm 1 [1].
    """
    dependent, norms = 1e-8, np.linalg.norm(regressor, axis=0)
    seen = np.flatnonzero(norms > dependent * norms.max(initial=0.0))
    if not len(seen):
        return seen, 1.0
    unit = regressor[:, seen] / norms[seen]
    factor, order = qr(unit, mode="r", pivoting=True, check_finite=False)
    size = np.abs(np.diag(factor[: len(seen)]))
    kept = order[: len(size)][size > dependent * size[0]]
    return np.sort(seen[kept]), float(np.linalg.cond(unit[:, kept]))


def divergence(parameters: Array, nominal: Array) -> tuple[float, Array, Array]:
    """Compute the sum of all bodies' d(P, P_0), its gradient, shape (L, 10), and Hessians, shape (L, 10, 10).

    Parameters and the model's `nominal` ones have shape (L, 10). The sum is infinite for impossible bodies.
    """
    matrix, model_inverse = pseudo_inertia(parameters), np.linalg.inv(pseudo_inertia(nominal))
    if np.linalg.eigvalsh(matrix).min(initial=np.inf) <= 0:
        return np.inf, np.zeros(parameters.shape), np.zeros((*parameters.shape, SIZE))
    inverse = np.linalg.inv(matrix)
    ratio = model_inverse @ matrix
    value = float(np.sum(np.trace(ratio, axis1=1, axis2=2) - np.linalg.slogdet(ratio)[1] - 4))
    gradient = np.einsum("lij,kji->lk", model_inverse - inverse, BASIS)
    turned = inverse[:, None] @ BASIS
    return value, gradient, np.einsum("lkij,lmji->lkm", turned, turned)


def minimise(
    information: Array, right: Array, nominal: Array, weight: float, precision: Array, bounded: BoolArray
) -> ConsistentFit:
    """Minimize a sum of squares and the weighted divergence, by Newton's method.

        1/2 x^T A x - b^T x + weight d(pi) + 1/2 beta^T diag(precision) beta,  x = (pi - pi_0, beta)

    Parameters
    ----------
    information, right
        A, shape (10 L + q,) * 2, and b, shape (10 L + q,).
    nominal
        pi_0 of physically possible bodies, shape (L, 10).
    weight
        Weight of the divergence.
    precision
        Precision of the friction coefficients' prior, shape (q,).
    bounded
        Mask of friction coefficients with a lower bound of zero, shape (q,).
    """
    size, held = nominal.size, np.zeros(len(precision), dtype=bool)

    def evaluate(x: Array) -> tuple[float, Array, Array]:
        value, gradient, hessians = divergence(nominal + x[:size].reshape(nominal.shape), nominal)
        slope = information @ x
        penalty = np.diag(np.append(np.zeros(size), precision))
        for k, hessian in enumerate(hessians):
            penalty[SIZE * k : SIZE * (k + 1), SIZE * k : SIZE * (k + 1)] = weight * hessian
        total = 0.5 * float(x @ slope + precision @ x[size:] ** 2) - float(right @ x) + weight * value
        return total, slope - right + np.append(weight * gradient.ravel(), precision * x[size:]), penalty

    def newton() -> tuple[Array, Array]:
        free, x = np.append(np.ones(size, dtype=bool), ~held), np.zeros(len(right))
        value, slope, penalty = evaluate(x)
        for _ in range(200):  # usually ten to thirty
            step = np.zeros(len(x))
            step[free] = _solve((information + penalty)[np.ix_(free, free)], -slope[free])
            decrement, length = -float(slope @ step), 1.0
            if decrement <= 1e-9 * (1 + abs(value) * 1e-6):  # errors have unit variance
                break
            while not (after := evaluate(x + length * step))[0] <= value - 1e-4 * length * decrement:
                length /= 2
                if length <= 1e-12:  # rounding: no step lowers the sum
                    return x, penalty
            x = x + length * step
            value, slope, penalty = after
        return x, penalty

    while True:
        x, penalty = newton()
        negative = bounded & ~held & (x[size:] < 0)
        if not negative.any():
            return ConsistentFit(nominal + x[:size].reshape(nominal.shape), x[size:], held, penalty)
        held |= negative


def _solve(matrix: Array, right: Array) -> Array:
    """Solve a positive definite system with unknowns of different units."""
    scale = 1 / np.sqrt(np.diag(matrix))
    unit = matrix * np.outer(scale, scale) + 1e-12 * np.eye(len(matrix))  # rounding error of an eigenvalue
    return np.asarray(scale * cho_solve(cho_factor(unit), scale * right))
