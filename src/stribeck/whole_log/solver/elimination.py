"""Elimination of the linear corrections, and joint fits of all laws to the remaining equations (docs/estimator-fit.md).

With the corrections x(u) ~ x_0 + T u, chi^2 is a quadratic of the coefficients theta of friction and of u, and the
best u for given theta is linear in them. Inserted, it leaves a quadratic of only theta (Schur complement),

    chi^2(theta) = theta^T S theta - 2 r^T theta + const,    S = A_ff - A_fc T (T^T A_cc T + prior)^-1 T^T A_cf

in which laws are fitted by Gauss-Newton (equations 19 and 20).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dpotri, dpotrs

from stribeck.base.typing import Array
from stribeck.whole_log.constants import CONVERGED
from stribeck.whole_log.model.corrections import Layout, ModelCorrections
from stribeck.whole_log.model.laws import Laws
from stribeck.whole_log.solver.gauss_newton import bounds_hold, minimise
from stribeck.whole_log.solver.statistics import Statistics


@dataclass(frozen=True, eq=False, kw_only=True)
class Fit:
    """A fit of all laws and corrections at once.

    Attributes
    ----------
    laws, model
        Coordinates of friction and of corrections, with their priors.
    internal, corrections
        Values of the coordinates, shape (n, w) and (c,).
    covariance
        Covariance of all coordinates, friction first, shape (m, m).
    at_bound
        Mask of the laws' parameters at a bound, shape (n, w).
    chi_square
        Chi^2 without the prior's share.
    converged
        Whether the descent converged.
    """

    laws: Laws
    model: ModelCorrections
    internal: Array
    corrections: Array
    covariance: Array
    at_bound: NDArray[np.bool_]
    chi_square: float
    converged: bool

    @property
    def layout(self) -> Layout:
        """Layout of the coordinates."""
        return replace(self.model.layout, joints=len(self.internal), per_joint=self.internal.shape[1])

    @property
    def x(self) -> Array:
        """All coordinates, friction first, shape (m,)."""
        return np.concatenate([self.internal.ravel(), self.corrections])

    @property
    def values(self) -> Array:
        """Coefficients, then corrections, shape (D,)."""
        return np.concatenate([self.laws.coefficients(self.internal).ravel(), self.model.values(self.corrections)])

    @property
    def variance(self) -> Array:
        """Variances of the laws' parameters, shape (n, w)."""
        return np.diag(self.covariance)[: self.internal.size].reshape(self.internal.shape)

    @property
    def model_variance(self) -> Array:
        """Variances of the corrections' coordinates, shape (c,)."""
        return np.diag(self.covariance)[self.internal.size :]

    def pulled(self, rows: Array) -> Array:
        """Convert derivatives by all values to derivatives by all coordinates, shape (D, k) -> (m, k)."""
        jacobians = self.laws.jacobians(self.internal)
        friction = rows[: jacobians.shape[0] * jacobians.shape[1]].reshape(*jacobians.shape[:2], -1)
        of_laws = (jacobians.transpose(0, 2, 1) @ friction).reshape(self.internal.size, -1)
        of_model = self.model.slopes(self.corrections).pulled(rows[len(rows) - len(self.corrections) :])
        return np.vstack([of_laws, of_model])

    def curvature(self, statistics: Statistics) -> Array:
        """Compute Gauss-Newton's second derivatives of half of chi^2, including the prior, shape (m, m)."""
        found = self.pulled(self.pulled(statistics.information).T)
        n = self.internal.size
        found[range(n), range(n)] += self.laws.prior[1].ravel() ** -2.0
        found[n:, n:] += self.model.precision
        return found


@dataclass(frozen=True, eq=False)
class Eliminated:
    """Chi^2 after elimination of the corrections.

    Attributes
    ----------
    information, right
        S, shape (f, f), and r, shape (f,).
    follow, alone
        Coefficients of the best corrections, u = `alone` - `follow` theta, shape (c, f) and (c,).
    covariance
        Covariance of u for given theta, shape (c, c).
    """

    information: Array
    right: Array
    follow: Array
    alone: Array
    covariance: Array


def eliminate(statistics: Statistics, model: ModelCorrections, around: Array) -> Eliminated:
    """Eliminate the corrections from chi^2, linearized around coordinates u, shape (c,)."""
    f = statistics.friction
    cross, inner, right = linearised(statistics, model, around)
    own = right[f:] + model.precision @ model.prior_mean
    covariance = inverse_of(inner + model.precision)
    follow = covariance @ cross
    return Eliminated(
        statistics.information[:f, :f] - cross.T @ follow,
        right[:f] - follow.T @ own,
        follow,
        covariance @ own,
        covariance,
    )


def linearised(statistics: Statistics, model: ModelCorrections, around: Array) -> tuple[Array, Array, Array]:
    """Compute the information on the corrections, linearized around some coordinates, and the right sides.

    The results are the information between corrections and friction, shape (c, f), and within corrections, shape
    (c, c), and the right sides of friction and corrections, shape (f + c,).
    """
    f, slopes = statistics.friction, model.slopes(around)
    fixed = model.values(around) - slopes.pushed(around[:, None])[:, 0]
    right = statistics.right - statistics.information[:, f:] @ fixed
    right[f:] = slopes.pulled(right[f:, None])[:, 0]
    inner = slopes.pulled(slopes.pulled(statistics.information[f:, f:]).T)
    return slopes.pulled(statistics.information[f:, :f]), inner, right


def times_blocks(rows: Array, blocks: Array) -> Array:
    """Multiply rows, shape (k, n q), by a block-diagonal matrix, shape (n, q, w), to shape (k, n w)."""
    n, q, w = blocks.shape
    product = rows.reshape(len(rows), n, q).transpose(1, 0, 2) @ blocks
    return product.transpose(1, 0, 2).reshape(len(rows), n * w)


@dataclass(frozen=True, eq=False)
class AllJoints:
    """Half of the eliminated chi^2, with the prior's share, for one descent: x has the shape (1, n w)."""

    laws: Laws
    information: Array
    right: Array

    def of(self, rows: NDArray[np.int64]) -> AllJoints:  # noqa: ARG002 - there is one descent
        """Return the problem itself."""
        return self

    def costs(self, x: Array) -> Array:
        """Compute the cost, shape (1,)."""
        internal = x.reshape(self.laws.free.shape)
        mean, deviation = self.laws.prior
        theta = self.laws.coefficients(internal).ravel()
        square = theta @ (self.information @ theta - 2 * self.right)
        return np.array([square + np.sum(((internal - mean) / deviation) ** 2)]) / 2

    def derivatives(self, x: Array) -> tuple[Array, Array]:
        """Compute the gradient, shape (1, n w), and second derivatives, shape (1, n w, n w)."""
        internal = x.reshape(self.laws.free.shape)
        mean, deviation = self.laws.prior
        jacobians = self.laws.jacobians(internal)
        n, q, w = jacobians.shape
        slope = self.information @ self.laws.coefficients(internal).ravel() - self.right
        gradient = (slope.reshape(n, 1, q) @ jacobians)[:, 0] + (internal - mean) / deviation**2
        half = times_blocks(self.information, jacobians).reshape(n, q, n * w)
        hessian = (jacobians.transpose(0, 2, 1) @ half).reshape(n * w, n * w)
        hessian[range(n * w), range(n * w)] += deviation.ravel() ** -2.0
        return gradient.reshape(1, -1), hessian[None]


@dataclass(frozen=True, eq=False)
class EachJoint:
    """Half of chi^2, except a constant, with the prior's share, for the laws of b single joints with all else fixed.

    Shapes (b, q, q) and (b, q); the same joint may occur more than once.
    """

    laws: Laws
    information: Array
    right: Array

    def of(self, rows: NDArray[np.int64]) -> EachJoint:
        """Select some of the descents."""
        return EachJoint(self.laws.of(rows), self.information[rows], self.right[rows])

    def costs(self, x: Array) -> Array:
        """Compute the costs at internal coordinates, shape (b, w) -> (b,)."""
        mean, deviation = self.laws.prior
        theta = self.laws.coefficients(x)
        squares = np.sum(theta * ((self.information @ theta[:, :, None])[:, :, 0] - 2 * self.right), axis=1)
        return np.asarray(squares + np.sum(((x - mean) / deviation) ** 2, axis=1)) / 2

    def derivatives(self, x: Array) -> tuple[Array, Array]:
        """Compute gradients, shape (b, w), and Gauss-Newton's second derivatives, shape (b, w, w)."""
        mean, deviation = self.laws.prior
        transposed = self.laws.jacobians(x).transpose(0, 2, 1)
        slope = self.information @ self.laws.coefficients(x)[:, :, None] - self.right[:, :, None]
        gradient = (transposed @ slope)[:, :, 0] + (x - mean) / deviation**2
        hessian = transposed @ self.information @ transposed.transpose(0, 2, 1)
        return gradient, hessian + np.eye(x.shape[1]) * deviation[:, None] ** -2.0

    def best(self, starts: Array) -> tuple[Array, Array]:
        """Run descents from starts, shape (b, w); return their ends and half of chi^2 there, shape (b,)."""
        found = minimise(self, starts, *self.laws.bounds)
        return found.x, found.cost


def solve(statistics: Statistics, start: Fit) -> Fit:
    """Fit the laws and corrections of another fit, from its values, to normal equations.

    Corrections are linearized, and linearized again around each solution until the cost stays the same. No rotor
    inertia is negative.
    """
    fit = _descend(statistics, start)
    while (model := fit.model.with_possible_rotors(fit.corrections)) is not fit.model:
        fit = _descend(statistics, replace(fit, model=model))
    return fit


def _descend(statistics: Statistics, start: Fit) -> Fit:
    """Fit the laws and corrections, rotors without a bound."""
    laws, model, u = start.laws, start.model, start.corrections
    x = np.clip(start.internal, *laws.bounds)
    low, high = (bound.reshape(1, -1) for bound in laws.bounds)
    cost = _cost(statistics, laws, model, x, u)
    for _ in range(30):
        left = eliminate(statistics, model, u)
        problem = AllJoints(laws, left.information, left.right)
        found = minimise(problem, x.reshape(1, -1), low, high)
        to_x = found.x.reshape(x.shape) - x
        to_u = left.alone - left.follow @ laws.coefficients(x + to_x).ravel() - u
        linear = model.values(u) + model.slopes(u).pushed(to_u[:, None])[:, 0]
        expected = _cost(statistics, laws, model, x + to_x, u + to_u, linear)
        before, share = cost, 1.0
        while (cost := _cost(statistics, laws, model, x + share * to_x, u + share * to_u)) > before and share > 1e-3:
            share /= 2  # the linearization holds only for a shorter step
        if cost > before:
            break
        x, u = x + share * to_x, u + share * to_u
        if before - cost < 20 * CONVERGED or abs(cost - expected) < 20 * CONVERGED:
            break
    gradient, hessian = problem.derivatives(x.reshape(1, -1))
    held = bounds_hold(x.reshape(1, -1), gradient, low, high)
    jacobians = laws.jacobians(x)
    own = inverse_of(hessian[0])
    follow = times_blocks(left.follow, jacobians)
    cross = -own @ follow.T
    values = np.concatenate([laws.coefficients(x).ravel(), model.values(u)])
    return replace(
        start,
        internal=x,
        corrections=u,
        covariance=np.block([[own, cross], [cross.T, left.covariance - follow @ cross]]),
        at_bound=held.reshape(x.shape),
        chi_square=statistics.chi_square(values),
        converged=bool(found.converged[0]),
    )


def _cost(
    statistics: Statistics, laws: Laws, model: ModelCorrections, x: Array, u: Array, corrections: Array | None = None
) -> float:
    """Compute half of chi^2 with the prior's share; `corrections` are computed from u if None."""
    mean, deviation = laws.prior
    off = u - model.prior_mean
    values = np.concatenate([laws.coefficients(x).ravel(), model.values(u) if corrections is None else corrections])
    share = np.sum(((x - mean) / deviation) ** 2) + off @ model.precision @ off
    return 0.5 * float(statistics.chi_square(values) + share)


def inverse_of(matrix: Array) -> Array:
    """Invert a positive definite matrix whose rows may have very different units.

    Eigenvalues below the rounding error are raised to it, because rounding can cancel the prior's share.
    """
    if not len(matrix):
        return np.zeros((0, 0))
    scale, scaled, factor, failed = _factor(matrix)
    if not failed:
        inverse = np.tril(dpotri(factor, lower=1)[0])
        inverse += np.tril(inverse, -1).T
    else:
        values, vectors = np.linalg.eigh(scaled)
        inverse = (vectors / np.maximum(values, np.finfo(float).eps * values[-1])) @ vectors.T
    return np.asarray(inverse * np.outer(scale, scale))


def solution_of(matrix: Array, right: Array) -> Array:
    """Solve positive definite equations with one right side, as by `inverse_of`."""
    scale, _, factor, failed = _factor(matrix)
    return inverse_of(matrix) @ right if failed else scale * dpotrs(factor, scale * right, lower=1)[0]


def _factor(matrix: Array) -> tuple[Array, Array, Array, int]:
    """Scale the rows and columns of a matrix, and factor it; return the scale and the scaled matrix, too."""
    scale = 1 / np.sqrt(np.maximum(np.abs(np.diag(matrix)), np.finfo(float).tiny))
    scaled = matrix * np.outer(scale, scale)
    return scale, scaled, *dpotrf(scaled, lower=1)
