"""Basis of the friction curves (docs/estimator.md, equation 11): a log is summed up before a law is fitted.

    R(v; p) ~ l(v)^T Phi theta(p),    theta(p) = Phi^T [R(v_1; p), ..., R(v_N; p)]

Knots v_1 ... v_N lie densest around standstill, where friction changes fastest; l interpolates between them. The basis
Phi are the left singular vectors of many curves of the law (Eckart and Young 1936).
"""

import itertools
from dataclasses import dataclass
from functools import cached_property
from itertools import zip_longest

import numpy as np
from scipy.sparse import csr_array

from stribeck.base.typing import Array
from stribeck.friction import FrictionLaw, Parameter
from stribeck.whole_log.constants import (
    BASIS_TOLERANCE,
    FINEST_KNOTS,
    KNOT_GROWTH,
    KNOT_REACH,
    SHAPE_GRID,
    SHAPE_REACH,
)

ORDER = 4
"""Knots [1] that a value in between is interpolated from, by Lagrange's cubic polynomial."""


@dataclass(frozen=True, eq=False)
class Basis:
    """Knots of n joints, and the basis of their curves.

    Attributes
    ----------
    velocity
        Of each joint's knots [rad/s], shape (n, N).
    functions
        Phi, values at the knots of a joint: orthonormal columns, the same for all joints, shape (N, r).
    modulated
        Functions that each covariate multiplies, as sums of the others, shape (r, s) each.
    reduced
        Few sums of all these that the curves of each joint are known to be made of, if any: coefficients as sums of
        fewer, and fewer from coefficients, shape (n, R, m) and (n, m, R).
    """

    velocity: Array
    functions: Array
    modulated: tuple[Array, ...] = ()
    reduced: tuple[Array, Array] | None = None

    @property
    def size(self) -> int:
        """Number of coefficients of all joints, n R with R = r and all s, or n m."""
        if self.reduced is not None:
            return int(self.velocity.shape[0] * self.reduced[0].shape[2])
        return int(self.velocity.shape[0] * (self.functions.shape[-1] + sum(each.shape[1] for each in self.modulated)))

    def fewer(self, coefficients: Array) -> Array:
        """Return what is left of the coefficients of all joints, shape (n, R, ...) -> (n, m, ...)."""
        return coefficients if self.reduced is None else np.einsum("nmr,nr...->nm...", self.reduced[1], coefficients)

    def coefficients(self, curves: Array, *times_covariates: Array) -> Array:
        """Return coefficients, shape (R, ...), of a joint's curves, shape (N, ...), and of those times covariates."""
        found = [self.functions.T @ curves]
        for functions, each in zip_longest(self._modulated, times_covariates):
            found.append(np.zeros((functions.shape[1], *curves.shape[1:])) if each is None else functions.T @ each)
        return np.concatenate(found)

    @cached_property
    def _modulated(self) -> list[Array]:
        """Values at the knots of the functions that each covariate multiplies, shape (N, s) each."""
        return [self.functions @ each for each in self.modulated]

    def windows(self, velocity: Array, taps: Array, step: int, count: int) -> Array:
        """Return the windows of all functions of the velocities (T, n), shape (count, n, r)."""
        joints, basis = self.velocity.shape
        columns = step * np.arange(count)[:, None] + np.arange(len(taps))
        starts = len(taps) * np.arange(count + 1)
        matrix = csr_array((np.tile(taps, count), columns.ravel(), starts), shape=(count, len(velocity)))
        values = (matrix @ self._weights(velocity)).toarray().reshape(count, joints, basis)
        return np.asarray((values.transpose(1, 0, 2) @ self.functions).transpose(1, 0, 2))

    def _weights(self, velocity: Array) -> csr_array:
        """Return the interpolation weights of velocities (T, n) as a sparse matrix, shape (T, n N).

        The weight of knot i among the four is the product of the distances to the others over that of i to them.
        """
        samples, joints = velocity.shape
        count = self.velocity.shape[1]
        first = np.empty((samples, joints), dtype=np.int32)
        for k, basis in enumerate(self.velocity):
            first[:, k] = np.searchsorted(basis, velocity[:, k])
        first = np.clip(first - ORDER // 2, 0, count - ORDER)
        first += count * np.arange(joints, dtype=np.int32)
        v = np.clip(velocity, self.velocity[:, 0], self.velocity[:, -1])
        a, b, c, d = (v - self.velocity.ravel()[first + i] for i in range(ORDER))
        ab, cd = a * b, c * d
        weights = np.stack([b * cd, a * cd, ab * d, ab * c], axis=2)
        weights /= self._spans[first]
        columns = first[:, :, None] + np.arange(ORDER, dtype=np.int32)
        starts = np.arange(samples + 1, dtype=np.int32) * joints * ORDER
        return csr_array((weights.ravel(), columns.ravel(), starts), shape=(samples, joints * count))

    @cached_property
    def _spans(self) -> Array:
        """Products of the distances of each knot of four to the other three, by the first of them, (n N, ORDER)."""
        basis = self.velocity.ravel()
        four = np.minimum(np.arange(len(basis))[:, None] + np.arange(ORDER), len(basis) - 1)
        apart = basis[four][:, :, None] - basis[four][:, None] + np.eye(ORDER)
        return np.asarray(apart.prod(axis=2))


def make_basis(law: FrictionLaw, top_speed: Array) -> Basis:
    """Return knots for joints with these top speeds [rad/s], shape (n,), and a basis for the curves of a law."""
    count = int(np.ceil(np.log1p(KNOT_GROWTH / FINEST_KNOTS * KNOT_REACH) / KNOT_GROWTH))
    positive = (
        np.expm1(np.arange(1, count + 1) * np.log1p(KNOT_GROWTH / FINEST_KNOTS * KNOT_REACH) / count)
        * FINEST_KNOTS
        / KNOT_GROWTH
    )
    shape = np.concatenate([-positive[::-1], [0.0], positive])
    functions = _functions(law, shape)
    return Basis(np.maximum(top_speed, 1e-9)[:, None] * shape, functions)


def _functions(law: FrictionLaw, velocity: Array) -> Array:
    """Return orthonormal functions that span the law's curves up to `BASIS_TOLERANCE`, for a top speed of one."""
    nonlinear = [parameter for parameter in law.parameters if parameter.starts]
    curves = np.hstack(
        [
            law.basis(velocity, {p.name: float(value) for p, value in zip(nonlinear, point, strict=True)})
            for point in itertools.product(*(grid_of(p) for p in nonlinear))
        ]
    )
    return spanning(curves / np.maximum(np.abs(curves).max(axis=0), 1e-12), BASIS_TOLERANCE)


def grid_of(parameter: Parameter) -> Array:
    """Return values of a nonlinear parameter that cover its starts and beyond, for a top speed of one."""
    low, high = min(parameter.starts) / SHAPE_REACH, max(parameter.starts) * SHAPE_REACH
    return np.geomspace(max(low, parameter.lower), min(high, parameter.upper), SHAPE_GRID)


def spanning(curves: Array, tolerance: float) -> Array:
    """Return orthonormal columns, shape (N, r), that miss no curve of (N, c) by more than a root mean square."""
    functions = np.asarray(np.linalg.svd(curves, full_matrices=False)[0])
    left = curves**2
    missed = left.sum(axis=0) - np.cumsum((functions.T @ curves) ** 2, axis=0)  # (rank, curves)
    enough = np.flatnonzero(np.sqrt(np.maximum(missed, 0.0) / len(curves)).max(axis=1) < tolerance)
    return functions[:, : int(enough[0]) + 1] if len(enough) else functions
