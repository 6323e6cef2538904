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

from stribeck.core.base.typing import Array
from stribeck.core.equations.constants import CONVERGED
from stribeck.core.estimator.model.corrections import ModelCorrections
from stribeck.core.estimator.model.laws import Laws
from stribeck.core.estimator.solver.fit import Fit
from stribeck.core.estimator.solver.gauss_newton import ROUNDING, bounds_hold, minimise
from stribeck.core.estimator.solver.positive_definite import inverse_of
from stribeck.core.estimator.solver.statistics import Statistics


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
    inner_right = right[f:] + model.precision @ model.prior_mean
    covariance = inverse_of(inner + model.precision)
    follow = covariance @ cross
    return Eliminated(
        statistics.information[:f, :f] - cross.T @ follow,
        right[:f] - follow.T @ inner_right,
        follow,
        covariance @ inner_right,
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
        minimum = minimise(self, starts, *self.laws.bounds)
        return minimum.x, minimum.cost


def solve(statistics: Statistics, start: Fit) -> Fit:
    """Fit the laws and corrections of another fit, from its values, to normal equations.

    Corrections are linearized, and linearized again around each solution until the cost stays the same. No rotor
    inertia is negative; one that is held at zero is as uncertain as without this bound.
    """
    fit = _descend(statistics, start)
    while (model := fit.model.with_possible_rotors(fit.corrections)) is not fit.model:
        fit = _descend(statistics, replace(fit, model=model))
    if fit.model is start.model:
        return fit
    free = replace(fit, model=start.model)
    return replace(free, covariance=inverse_of(free.curvature(statistics)))


def _descend(statistics: Statistics, start: Fit) -> Fit:
    """Fit the laws and corrections, rotors without a bound."""
    laws, model, u = start.laws, start.model, start.corrections
    x = np.clip(start.internal, *laws.bounds)
    low, high = (bound.reshape(1, -1) for bound in laws.bounds)
    cost, tolerance = _cost(statistics, laws, model, x, u), max(20 * CONVERGED, ROUNDING * statistics.square)
    for _ in range(30):
        system = eliminate(statistics, model, u)
        problem = AllJoints(laws, system.information, system.right)
        minimum = minimise(problem, x.reshape(1, -1), low, high)
        to_x = minimum.x.reshape(x.shape) - x
        to_u = system.alone - system.follow @ laws.coefficients(x + to_x).ravel() - u
        linear = model.values(u) + model.slopes(u).pushed(to_u[:, None])[:, 0]
        expected = _cost(statistics, laws, model, x + to_x, u + to_u, linear)
        before, cost, share = cost, np.nan, 2.0
        while not cost <= before and share > 1e-3:  # a long step may overflow, and then costs no number
            share /= 2  # the linearization holds only for a shorter step
            cost = _cost(statistics, laws, model, x + share * to_x, u + share * to_u)
        if not cost <= before:
            break
        x, u = x + share * to_x, u + share * to_u
        if before - cost < tolerance or abs(cost - expected) < tolerance:
            break
    gradient, hessian = problem.derivatives(x.reshape(1, -1))
    held = bounds_hold(x.reshape(1, -1), gradient, low, high)
    jacobians = laws.jacobians(x)
    covariance = inverse_of(hessian[0])
    follow = times_blocks(system.follow, jacobians)
    cross = -covariance @ follow.T
    values = np.concatenate([laws.coefficients(x).ravel(), model.values(u)])
    return replace(
        start,
        internal=x,
        corrections=u,
        covariance=np.block([[covariance, cross], [cross.T, system.covariance - follow @ cross]]),
        at_bound=held.reshape(x.shape),
        chi_square=statistics.chi_square(values),
        converged=bool(minimum.converged[0]),
    )


def _cost(
    statistics: Statistics, laws: Laws, model: ModelCorrections, x: Array, u: Array, corrections: Array | None = None
) -> float:
    """Compute half of chi^2 with the prior's share; `corrections` are computed from u if None."""
    values = np.concatenate([laws.coefficients(x).ravel(), model.values(u) if corrections is None else corrections])
    mean, deviation = laws.prior
    off = u - model.prior_mean
    prior = float(np.sum(((x - mean) / deviation) ** 2) + off @ model.precision @ off)
    return 0.5 * float(statistics.chi_square(values) + prior)


def best_starts(laws: Laws, information: Array, right: Array) -> tuple[Array, Array]:
    """Run descents from each joint's four best starts; return the best end, shape (n, w), and its cost, shape (n,).

    The joints' normal equations have shape (n, q, q) and (n, q).
    """
    starts = [laws.linear_starts(k, *equations)[:4] for k, equations in enumerate(zip(information, right, strict=True))]
    owners = np.repeat(np.arange(len(starts)), [len(joint_starts) for joint_starts in starts])
    ends, costs = EachJoint(laws.of(owners), information[owners], right[owners]).best(np.concatenate(starts))
    places = [np.flatnonzero(owners == k)[np.argmin(costs[owners == k])] for k in range(len(starts))]
    return ends[places], costs[places]


def best_of_linear(laws: Laws, theta: Array, covariance: Array) -> Array:
    """Find the internal coordinates of laws that fit linear coefficients best, shape (n, w).

    The joints' coefficients have shape (n, q). Their covariance, shape (n, q, q), includes all other uncertainty.
    """
    information = np.asarray(np.linalg.inv(covariance))
    return best_starts(laws, information, (information @ theta[:, :, None])[:, :, 0])[0]


def times_blocks(rows: Array, blocks: Array) -> Array:
    """Multiply rows, shape (k, n q), by a block-diagonal matrix, shape (n, q, w), to shape (k, n w)."""
    n, q, w = blocks.shape
    product = rows.reshape(len(rows), n, q).transpose(1, 0, 2) @ blocks
    return product.transpose(1, 0, 2).reshape(len(rows), n * w)


def blocks(information: Array, joints: int) -> Array:
    """Extract the blocks of single joints, shape (n q, n q) -> (n, q, q)."""
    q = len(information) // joints
    return information.reshape(joints, q, joints, q)[range(joints), :, range(joints)].copy()
