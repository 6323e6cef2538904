"""Basis of the friction curves (docs/estimator.md, equation 11), which allows to sum a log before a law is fitted.

    R(v; p) ~ l(v)^T Phi theta(p),    theta(p) = Phi^T [R(v_1; p), ..., R(v_N; p)]

Knots v_1 ... v_N are densest around standstill, where friction changes fastest; l interpolates between them. The basis
Phi consists of the left singular vectors of many curves of the law (Eckart and Young 1936).
"""

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy  # its sparse is slow to import: loaded at its first use

from stribeck.core.base.typing import Array
from stribeck.core.friction import FrictionLaw, Parameter


@dataclass(frozen=True, eq=False)
class Basis:
    """Knots of n joints, and the basis of their curves.

    Attributes
    ----------
    velocity
        Velocities of each joint's knots [rad/s], shape (n, N).
    functions
        Phi, values at the knots of a joint: orthonormal columns, the same for all joints, shape (N, R).
    variance
        Variances of the coefficients over the law's curves, scaled to a largest value of one, shape (R,).
    """

    velocity: Array
    functions: Array
    variance: Array

    def windows(self, velocity: Array, taps: Array, step: int, count: int) -> Array:
        """Compute the windows of all functions of the velocities (T, n), shape (count, n, R)."""
        joints, knots = self.velocity.shape
        columns = step * np.arange(count)[:, None] + np.arange(len(taps))
        starts = len(taps) * np.arange(count + 1)
        matrix = scipy.sparse.csr_array((np.tile(taps, count), columns.ravel(), starts), shape=(count, len(velocity)))
        values = (matrix @ self._weights(velocity)).toarray().reshape(count, joints, knots)
        return np.asarray((values.transpose(1, 0, 2) @ self.functions).transpose(1, 0, 2))

    def _weights(self, velocity: Array) -> scipy.sparse.csr_array:
        """Compute the interpolation weights of velocities (T, n) as a sparse matrix, shape (T, n N).

        Lagrange's cubic polynomial: the weight of knot i among the four nearest is the product of the velocity's
        distances to the other three, divided by the product of knot i's distances to them.
        """
        samples, joints = velocity.shape
        count = self.velocity.shape[1]
        first = np.empty((samples, joints), dtype=np.int32)
        for k, knots in enumerate(self.velocity):
            first[:, k] = np.searchsorted(knots, velocity[:, k])
        first = np.clip(first - 2, 0, count - 4)
        first += count * np.arange(joints, dtype=np.int32)
        v = np.clip(velocity, self.velocity[:, 0], self.velocity[:, -1])
        a, b, c, d = (v - self.velocity.ravel()[first + i] for i in range(4))
        ab, cd = a * b, c * d
        weights = np.stack([b * cd, a * cd, ab * d, ab * c], axis=2)
        weights /= self._spans[first]
        columns = first[:, :, None] + np.arange(4, dtype=np.int32)
        starts = np.arange(samples + 1, dtype=np.int32) * joints * 4
        return scipy.sparse.csr_array((weights.ravel(), columns.ravel(), starts), shape=(samples, joints * count))

    def odd(self, joint: int, speeds: Array) -> Array:
        """Compute the resisting torque of each function at some speeds [rad/s] of a joint, shape (s,) -> (s, R)."""
        v = self.velocity[joint]
        both = [np.interp(speeds, v, function) - np.interp(-speeds, v, function) for function in self.functions.T]
        return np.stack(both, axis=1) / 2

    @cached_property
    def _spans(self) -> Array:
        """Products of the distances of each of four consecutive knots to the other three, by first knot, (n N, 4)."""
        knots = self.velocity.ravel()
        four = np.minimum(np.arange(len(knots))[:, None] + np.arange(4), len(knots) - 1)
        apart = knots[four][:, :, None] - knots[four][:, None] + np.eye(4)
        return np.asarray(apart.prod(axis=2))


def make_basis(law: FrictionLaw, top_speed: Array, tolerance: float = 1e-3) -> Basis:
    """Build knots for joints with these top speeds [rad/s], shape (n,), and a basis for the curves of a law.

    The error of each curve is at most `tolerance` of its largest value, root mean square over the knots.
    """
    finest, growth, outermost = 1.5e-3, 0.12, 1.05  # relative to the top speed, which some samples exceed
    reach = np.log1p(growth / finest * outermost)
    count = int(np.ceil(reach / growth))
    positive = np.expm1(np.arange(1, count + 1) * reach / count) * finest / growth
    shape = np.concatenate([-positive[::-1], [0.0], positive])
    nonlinear = [parameter for parameter in law.parameters if parameter.starts]
    points = itertools.product(*(grid_of(p) for p in nonlinear))
    shapes = [{p.name: float(x) for p, x in zip(nonlinear, point, strict=True)} for point in points]
    curves = np.hstack([law.basis(shape, parameters) for parameters in shapes])
    curves /= np.maximum(np.abs(curves).max(axis=0), 1e-12)
    functions, sizes, _ = np.linalg.svd(curves, full_matrices=False)
    missed = (curves**2).sum(axis=0) - np.cumsum((functions.T @ curves) ** 2, axis=0)
    enough = np.sqrt(np.maximum(missed, 0.0) / len(curves)).max(axis=1) < tolerance
    rank = int(np.argmax(enough)) + 1 if enough.any() else functions.shape[1]
    variance = sizes[:rank] ** 2 / curves.shape[1]
    return Basis(np.maximum(top_speed, 1e-9)[:, None] * shape, functions[:, :rank], variance)


def grid_of(parameter: Parameter) -> Array:
    """Choose nine values of a nonlinear parameter that cover its starts and a factor of three around them."""
    low, high = min(parameter.starts) / 3, max(parameter.starts) * 3
    return np.geomspace(max(low, parameter.lower), min(high, parameter.upper), 9)
