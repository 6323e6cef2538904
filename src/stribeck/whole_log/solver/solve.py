"""The fit of all joints and corrections at once to the normal equations (docs/estimator.md, equations 16 and 17)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from stribeck.base.typing import Array
from stribeck.whole_log.model.friction_curves import Curves
from stribeck.whole_log.model.layout import ModelLayout
from stribeck.whole_log.model.model_corrections import ModelCorrections
from stribeck.whole_log.model.parametrisation import Parametrisation
from stribeck.whole_log.solver.gauss_newton import bounds_hold, minimise
from stribeck.whole_log.solver.normal_equations import NormalEquations


@dataclass(frozen=True, eq=False, kw_only=True)
class Solution:
    """Minimum of the cost.

    Attributes
    ----------
    layout
        Of the coordinates.
    x
        Coordinates of friction, then of the model's corrections, shape (m,).
    covariance
        Of x, shape (m, m).
    at_bound
        Which parameters of the laws are at bound, shape (n, p).
    chi_square
        Without the prior's share.
    cost
        Half of chi_square plus the prior's share.
    converged
        Whether the descent converged.
    """

    layout: ModelLayout
    x: Array
    covariance: Array
    at_bound: NDArray[np.bool_]
    chi_square: float
    cost: float
    converged: bool

    @property
    def internal(self) -> Array:
        """Internal coordinates of the laws' parameters, shape (n, p)."""
        return self.x[self.layout.friction].reshape(self.layout.joints, -1)

    @property
    def corrections(self) -> Array:
        """Coordinates of the model's corrections, shape (c,)."""
        return self.x[self.layout.model]

    @property
    def variance(self) -> Array:
        """Variances of the laws' parameters, shape (n, p)."""
        return np.diag(self.covariance)[self.layout.friction].reshape(self.internal.shape)

    @property
    def model_variance(self) -> Array:
        """Variances of the corrections' coordinates, shape (c,)."""
        return np.diag(self.covariance)[self.layout.model]


@dataclass(frozen=True, eq=False)
class _Cost:
    """Equation (16): f(x) = chi^2(y(x)) / 2 + (x - mean)^T P (x - mean) / 2, P the prior's inverse covariance."""

    normal_equations: NormalEquations
    parameters: Parametrisation

    def of(self, rows: NDArray[np.int64]) -> _Cost:  # noqa: ARG002 - the same for each descent
        return self

    def chi_square(self, x: Array) -> float:
        """Return the log's share at one x, shape (m,)."""
        y = self.parameters.values(x)
        return self.normal_equations.square + float(
            y @ (self.normal_equations.information @ y - 2 * self.normal_equations.right_hand_side)
        )

    def costs(self, x: Array) -> Array:
        mean, precision = self.parameters.prior
        return np.array([0.5 * (self.chi_square(row) + (row - mean) @ precision @ (row - mean)) for row in x])

    def derivatives(self, x: Array) -> tuple[Array, Array]:
        found = [self.derivatives_at(row) for row in x]
        return np.stack([gradient for gradient, _ in found]), np.stack([hessian for _, hessian in found])

    def derivatives_at(self, x: Array) -> tuple[Array, Array]:
        """Return gradient, shape (m,), and Gauss-Newton's second derivatives, shape (m, m), at one x."""
        slope = self.normal_equations.information @ self.parameters.values(x) - self.normal_equations.right_hand_side
        jacobian = self.parameters.blocks(x)
        half = self.parameters.times_jacobian(np.vstack([self.normal_equations.information, slope]), jacobian)
        mean, precision = self.parameters.prior
        hessian = self.parameters.times_jacobian(half[:-1].T, jacobian).T + precision
        return half[-1] + precision @ (x - mean), hessian


def solve(
    normal_equations: NormalEquations, curves: Curves, model: ModelCorrections, before: Solution | None = None
) -> Solution:
    """Return the best of two descents, or the descent from a solution of nearly the same problem.

    Parameters
    ----------
    normal_equations
        Of the log.
    curves, model
        Coordinates of friction and of corrections, with their priors.
    before
        Start; if None, two linear fits, with low and with higher Stribeck velocities.
    """
    cost = _Cost(normal_equations, Parametrisation(curves, model))
    layout, friction = cost.parameters.layout, normal_equations.layout.friction
    starts = np.zeros((1, layout.size)) if before is None else before.x[None]
    if before is None:
        information, right = (
            normal_equations.information[friction, friction],
            normal_equations.right_hand_side[friction],
        )
        linear = [curves.linear_start(shapes, information, right).ravel() for shapes in curves.shapes()]
        starts = np.tile(starts, (len(linear), 1))
        starts[:, layout.friction] = linear
    low, high = np.full((2, *starts.shape), [[[-np.inf]], [[np.inf]]])
    low[:, layout.friction], high[:, layout.friction] = (
        np.broadcast_to(bound, (layout.joints, layout.per_joint)).ravel() for bound in curves.bounds
    )
    found = minimise(cost, starts, low, high)
    best = int(np.argmin(found.cost))
    x = found.x[best]
    gradient, hessian = cost.derivatives_at(x)
    held = bounds_hold(x, gradient, low[best], high[best])[layout.friction]
    return Solution(
        layout=layout,
        x=x,
        covariance=inverse_of(hessian),
        at_bound=held.reshape(layout.joints, -1),
        chi_square=cost.chi_square(x),
        cost=float(found.cost[best]),
        converged=bool(found.converged[best]),
    )


def curvature(normal_equations: NormalEquations, curves: Curves, model: ModelCorrections, at: Solution) -> Array:
    """Return Gauss-Newton's second derivatives of half of chi^2 at a solution, the prior's included."""
    return derivatives(normal_equations, curves, model, at)[1]


def derivatives(
    normal_equations: NormalEquations, curves: Curves, model: ModelCorrections, at: Solution
) -> tuple[Array, Array]:
    """Return gradient and curvature of half of chi^2 at a solution, the prior's included."""
    return _Cost(normal_equations, Parametrisation(curves, model)).derivatives_at(at.x)


def inverse_of(matrix: Array) -> Array:
    """Return the inverse of a positive definite matrix whose rows may be of very different units.

    Where rounding has taken from an eigenvalue all that the prior had put there, it is as large as rounding.
    """
    scale = 1 / np.sqrt(np.diag(matrix))
    scaled = matrix * np.outer(scale, scale)
    try:
        inverse = cho_solve(cho_factor(scaled), np.eye(len(matrix)))
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(scaled)
        inverse = (vectors / np.maximum(values, np.finfo(float).eps * values[-1])) @ vectors.T
    return np.asarray(inverse * np.outer(scale, scale))
