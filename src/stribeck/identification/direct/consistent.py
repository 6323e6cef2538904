"""Least squares over bodies that can exist: a convex problem with one minimum (docs/direct.md, 4).

The entropic divergence of a body's pseudo-inertia P from the model's P_0,

    d(P, P_0) = tr(P_0^-1 P) - log det(P_0^-1 P) - 4

is convex, the same in every frame, and infinite where P stops being positive definite, so that what minimises a sum of
squares and it is physically consistent (Lee, Wensing and Park 2020).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from stribeck.inertial_parameters import SIZE, pseudo_inertia
from stribeck.typing import Array

BASIS = pseudo_inertia(np.eye(SIZE))
"""Derivatives of the pseudo-inertia by the ten parameters, shape (10, 4, 4)."""

STEPS = 200
"""Newton steps at most [1]; ten to thirty are usual."""

ROUNDING = 1e-12
"""What rounding may take from an eigenvalue of the Hessian, of ones on its diagonal [1]."""

CONVERGED = 1e-9
"""Newton decrement squared [1], of a sum of squares whose errors have variance one."""


@dataclass(frozen=True, eq=False)
class Minimum:
    """Parameters (L, 10), friction coefficients (q,), which of these are held at zero, and the penalty's Hessian."""

    parameters: Array
    coefficients: Array
    held: NDArray[np.bool_]
    hessian: Array


def divergence(parameters: Array, nominal: Array) -> tuple[float, Array, Array]:
    """Return the sum of all bodies' d(P, P_0), its gradient, shape (L, 10), and Hessians, shape (L, 10, 10).

    Parameters and the model's `nominal` ones have shape (L, 10). The sum is infinite where a body cannot exist.
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
    information: Array, right: Array, nominal: Array, weight: float, precision: Array, bounded: NDArray[np.bool_]
) -> Minimum:
    """Return the minimum of a sum of squares and the weighted divergence, by Newton's method.

        1/2 x^T A x - b^T x + weight d(pi) + 1/2 beta^T diag(precision) beta,  x = (pi - pi_0, beta)

    Parameters
    ----------
    information, right
        A, shape (10 L + q,) * 2, and b, shape (10 L + q,).
    nominal
        pi_0, shape (L, 10), of bodies that can exist.
    weight
        Of the divergence.
    precision
        Of the friction coefficients' prior, shape (q,).
    bounded
        Friction coefficients that may not be negative, shape (q,): those that would be are held at zero.
    """
    held = np.zeros(len(precision), dtype=bool)
    while True:
        found = _newton(information, right, nominal, weight, precision, held)
        negative = bounded & ~held & (found.coefficients < 0)
        if not negative.any():
            return found
        held |= negative


def _newton(
    information: Array, right: Array, nominal: Array, weight: float, precision: Array, held: NDArray[np.bool_]
) -> Minimum:
    size = nominal.size
    free = np.append(np.ones(size, dtype=bool), ~held)
    x = np.zeros(len(right))

    def evaluate(x: Array) -> tuple[float, Array, Array]:
        value, gradient, hessians = divergence(nominal + x[:size].reshape(nominal.shape), nominal)
        slope = information @ x
        penalty = np.diag(np.append(np.zeros(size), precision))
        for k, own in enumerate(hessians):
            penalty[SIZE * k : SIZE * (k + 1), SIZE * k : SIZE * (k + 1)] = weight * own
        total = 0.5 * float(x @ slope + precision @ x[size:] ** 2) - float(right @ x) + weight * value
        return total, slope - right + np.append(weight * gradient.ravel(), precision * x[size:]), penalty

    value, slope, penalty = evaluate(x)
    for _ in range(STEPS):
        step = np.zeros(len(x))
        step[free] = _solve((information + penalty)[np.ix_(free, free)], -slope[free])
        decrement = -float(slope @ step)
        if decrement <= CONVERGED * (1 + abs(value) * 1e-6):
            break
        length = 1.0
        while length > 1e-12:
            after = evaluate(x + length * step)
            if after[0] <= value - 1e-4 * length * decrement:
                break
            length /= 2
        else:
            break  # rounding: no step lowers the sum
        x = x + length * step
        value, slope, penalty = after
    return Minimum(nominal + x[:size].reshape(nominal.shape), x[size:], held, penalty)


def _solve(matrix: Array, right: Array) -> Array:
    """Solve a positive definite system whose unknowns have units of any size."""
    scale = 1 / np.sqrt(np.diag(matrix))
    unit = matrix * np.outer(scale, scale) + ROUNDING * np.eye(len(matrix))
    return np.asarray(scale * cho_solve(cho_factor(unit), scale * right))
