"""One friction law for all joints, in the basis of the curves, plus additional terms (docs/estimator.md).

A joint's coefficients are the coefficients of its curve, then of the linear terms (`model/terms.py`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from typing import Self

import numpy as np

from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.estimator.model.basis import Basis
from stribeck.core.friction import AUTO, FrictionLaw, Parameter
from stribeck.core.judgement.curve_fit.problem import to_external, to_internal
from stribeck.core.settings import Priors

FIXED = 1e-9
"""Standard deviation of the internal coordinate of a parameter that a joint's law does not use."""


@dataclass(frozen=True, eq=False)
class Laws:
    """Friction law of n joints, with w parameters each.

    Attributes
    ----------
    law
        Friction law.
    basis
        Knots of the curves, and their basis functions.
    terms
        Parameters of the additional terms, each of which multiplies a column.
    top_speed, torque
        Scales of each joint [rad/s], [N m], shape (n,).
    priors
        Standard deviations of the prior.
    free
        Mask of the parameters in each joint's law, shape (n, w).
    group_prior
        Mean and standard deviation over the joints of internal coordinates, shape (2, w); NaN for coordinates that are
        not shared, None before empirical Bayes.
    """

    law: FrictionLaw
    basis: Basis
    terms: tuple[Parameter, ...]
    top_speed: Array
    torque: Array
    priors: Priors
    free: BoolArray
    group_prior: Array | None = field(default=None, kw_only=True)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of one joint: of the law, then of the terms."""
        return (*self.law.parameters, *self.terms)

    @property
    def shared(self) -> list[int]:
        """Indices of parameters with a group prior: logarithms, and dimensionless numbers without a sign."""
        parameters = self.law.parameters
        return [k for k, p in enumerate(parameters) if p.logarithmic or (p.unit == "1" and p.lower >= 0)]

    def of(self, joints: Sequence[int] | IntArray) -> Self:
        """Select the laws of some joints; repeated joints are repeated."""
        return replace(
            self,
            basis=replace(self.basis, velocity=self.basis.velocity[joints]),
            top_speed=self.top_speed[joints],
            torque=self.torque[joints],
            free=self.free[joints],
        )

    def only(self, free: BoolArray) -> Self:
        """Restrict the laws to these of their parameters, shape (n, w)."""
        return replace(self, free=free & self.free)

    @cached_property
    def neutral(self) -> Array:
        """Neutral internal coordinates, shape (w,); NaN for mandatory parameters."""
        values = [np.nan if parameter.neutral is None else parameter.neutral for parameter in self.parameters]
        return to_internal(np.array(values), self.logarithmic)

    @cached_property
    def logarithmic(self) -> BoolArray:
        """Mask of parameters that are fitted by their logarithm, shape (w,)."""
        return np.array([parameter.logarithmic for parameter in self.parameters])

    @cached_property
    def bounds(self) -> Array:
        """Bounds of the internal coordinates, shape (2, n, w): equal for unused parameters."""
        bounds = np.array([(parameter.lower, parameter.upper) for parameter in self.parameters]).T
        return np.where(self.free, to_internal(bounds, self.logarithmic)[:, None, :], self.neutral)

    def external(self, internal: Array) -> Array:
        """Convert internal coordinates, shape (n, w), to parameter values, shape (n, w)."""
        return to_external(internal, self.logarithmic)

    def coefficients(self, internal: Array) -> Array:
        """Compute the coefficients of all joints, shape (n, q): of the curves [N m], then of the terms."""
        values, count = self.external(internal), len(self.law.parameters)
        if self.law.name == AUTO:  # accepts values with more axes
            torque = self.law.torque(self.basis.velocity, values[:, :count].T[:, :, None])
        else:
            torque = np.stack([self.law.torque(v, p[:count]) for v, p in zip(self.basis.velocity, values, strict=True)])
        return np.hstack([torque @ self.basis.functions, values[:, count:]])

    def jacobians(self, internal: Array) -> Array:
        """Compute the derivatives of the coefficients by each joint's internal coordinates, shape (n, q, w)."""
        values, count, v = self.external(internal), len(self.law.parameters), self.basis.velocity
        if self.law.name == AUTO:  # all joints' at once
            derivatives = self.law.jacobian(v.ravel(), np.repeat(values[:, :count].T, v.shape[1], axis=1))
            derivatives = derivatives.reshape(*v.shape, count)
        else:
            derivatives = np.stack([self.law.jacobian(speeds, p[:count]) for speeds, p in zip(v, values, strict=True)])
        functions = self.basis.functions.shape[1]
        jacobians = np.zeros((len(values), functions + len(self.terms), len(self.parameters)))
        jacobians[:, :functions, :count] = self.basis.functions.T @ (
            derivatives * np.where(self.logarithmic, values, 1.0)[:, None, :count]
        )
        jacobians[:, functions:, count:] = np.eye(len(self.terms))
        return jacobians

    @cached_property
    def prior(self) -> tuple[Array, Array]:
        """Mean and standard deviation of the prior of the internal coordinates, shape (n, w) each."""
        mean, prior_std = np.zeros((2, *self.free.shape))
        units = {"N m": self.torque, "N m s/rad": self.torque / self.top_speed, "rad/s": self.top_speed}
        units |= {"N m/K": self.torque, "N m s/(rad K)": self.torque / self.top_speed}
        for k, parameter in enumerate(self.parameters):
            if parameter.logarithmic:
                middle = float(np.mean(np.log(parameter.starts)))
                mean[:, k] = middle + parameter.start_speed_power * np.log(self.top_speed)
                prior_std[:, k] = self.priors.scale
            elif parameter.unit in units:
                prior_std[:, k] = self.priors.friction * units[parameter.unit]
            else:
                prior_std[:, k] = self.priors.pure_number
        if self.group_prior is not None:
            known = np.isfinite(self.group_prior[0])
            mean[:, known], prior_std[:, known] = self.group_prior[:, None, known]
        return np.where(self.free, mean, self.neutral), np.where(self.free, prior_std, FIXED)

    def linear_starts(self, joint: int, information: Array, right: Array) -> Array:
        """Compute starts of one joint's descent, shape (s, w), from its normal equations, shape (q, q) and (q,).

        Each start is the linear fit for one set of nonlinear parameters; the best fit comes first.
        """
        free = dict(zip((p.name for p in self.parameters), self.free[joint], strict=True))
        nonlinear = [parameter for parameter in self.law.parameters if parameter.starts]
        speed, count = float(self.top_speed[joint]), len(self.law.parameters)
        tried = [
            [s * speed**p.start_speed_power for s in p.starts] if free[p.name] else [float(p.neutral or 0.0)]
            for p in nonlinear
        ]
        places, functions = np.flatnonzero(self.free[joint, count:]), self.basis.functions.shape[1]
        starts = np.tile(self.neutral, (int(np.prod([len(grid) for grid in tried])), 1))
        scores = np.empty(len(starts))
        for k, point in enumerate(product(*tried)):
            shape = dict(zip((p.name for p in nonlinear), point, strict=True))
            columns = self.basis.functions.T @ self.law.basis(self.basis.velocity[joint], shape)
            linear = columns.shape[1]
            whole = np.zeros((len(right), linear + len(places)))
            whole[:functions, :linear], whole[functions + places, linear + np.arange(len(places))] = columns, 1.0
            matrix, vector = whole.T @ information @ whole, whole.T @ right
            coefficients = np.linalg.solve(
                matrix + np.diag(1e-6 * np.diag(matrix) + 1e-9 * max(float(matrix.max()), 1e-30)), vector
            )
            bounded = [i for i in range(linear) if i not in self.law.free_coefficients]
            coefficients[bounded] = np.maximum(coefficients[bounded], 1e-2 * self.torque[joint])
            starts[k, :count] = to_internal(
                self.law.from_linear(np.asarray(coefficients[:linear]), shape), self.logarithmic[:count]
            )
            starts[k, count + places] = coefficients[linear:]
        starts = np.clip(starts, *self.bounds[:, joint])
        values = self.of([joint] * len(starts)).coefficients(starts)
        scores = np.einsum("sq,sq->s", values, values @ information - 2 * right)
        return starts[np.argsort(scores, kind="stable")]
