"""Friction curves of all joints in the basis (docs/estimator.md, equation 11), and priors of their parameters."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from stribeck.base.typing import Array
from stribeck.friction import FrictionLaw, Parameter
from stribeck.judgement.curve_fit.problem import to_external, to_internal
from stribeck.settings import Priors
from stribeck.whole_log.model.basis import Basis

FIXED = 1e-9
"""Standard deviation of a parameter that a joint does without, in its internal coordinate."""


@dataclass(frozen=True, eq=False)
class Curves:
    """The same law for n joints with p parameters each.

    Attributes
    ----------
    law
        Friction law.
    basis
        Knots of the curves, and the basis that they are sums of.
    top_speed, torque
        Scales of each joint [rad/s], [N m], shape (n,).
    priors
        Standard deviations of the prior.
    group_prior
        Mean and standard deviation over the joints of internal coordinates, shape (2, p); NaN for what is
        not shared, None before empirical Bayes.
    free
        Which parameters each joint has, shape (n, p); all if None.
    """

    law: FrictionLaw
    basis: Basis
    top_speed: Array
    torque: Array
    priors: Priors
    group_prior: Array | None = field(default=None, kw_only=True)
    free: NDArray[np.bool_] | None = field(default=None, kw_only=True)

    @property
    def shared(self) -> list[int]:
        """Which parameters have a group prior: logarithms, and pure numbers without a sign."""
        return [k for k, p in enumerate(self.law.parameters) if p.logarithmic or (p.unit == "1" and p.lower >= 0)]

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Those of one joint."""
        return self.law.parameters

    def of(self, joints: Sequence[int] | NDArray[np.int64]) -> Self:
        """Return the curves of some joints, each as often as it is named."""
        basis = replace(self.basis, velocity=self.basis.velocity[joints])
        free = None if self.free is None else self.free[joints]
        return replace(self, basis=basis, top_speed=self.top_speed[joints], torque=self.torque[joints], free=free)

    @cached_property
    def having(self) -> NDArray[np.bool_]:
        """Which parameters each joint has, shape (n, p)."""
        return np.broadcast_to(True if self.free is None else self.free, (len(self.top_speed), len(self.parameters)))

    def has(self, joint: int) -> NDArray[np.bool_]:
        """Return which of them a joint has, shape (p,)."""
        return np.asarray(self.having[joint])

    def only(self, free: NDArray[np.bool_]) -> Self:
        """Return the curves of joints with none but these of their parameters, shape (n, p)."""
        return replace(self, free=free & self.having)

    @cached_property
    def neutral(self) -> Array:
        """Internal coordinates of a joint that does without, shape (p,); nan for what every joint has."""
        return to_internal(np.array([neutral_value(parameter) for parameter in self.parameters]), self.logarithmic)

    @cached_property
    def logarithmic(self) -> NDArray[np.bool_]:
        """Which parameters are fitted by their logarithm, shape (p,)."""
        return np.array([parameter.logarithmic for parameter in self.parameters])

    @cached_property
    def bounds(self) -> Array:
        """Bounds of the internal coordinates, shape (2, n, p): one value where a joint does without."""
        bounds = np.array([(parameter.lower, parameter.upper) for parameter in self.parameters]).T
        return np.where(self.having, to_internal(bounds, self.logarithmic)[:, None, :], self.neutral)

    def external(self, internal: Array) -> Array:
        """Return parameter values, shape (n, p), from internal coordinates, shape (n, p)."""
        return to_external(internal, self.logarithmic)

    def coefficients(self, internal: Array) -> Array:
        """Return the coefficients of all joints' friction curves [N m], shape (n r,)."""
        values = self.external(internal)
        curves = [self.law.torque(v, p) for v, p in zip(self.basis.velocity, values, strict=True)]
        return self.basis.fewer(np.stack(curves) @ self.basis.functions).ravel()

    def jacobians(self, internal: Array) -> Array:
        """Return their derivatives by each joint's own internal coordinates, shape (n, r, p)."""
        values = self.external(internal)
        factor = np.where(self.logarithmic, values, 1.0)
        jacobians = [self.law.jacobian(v, p) for v, p in zip(self.basis.velocity, values, strict=True)]
        return self.basis.fewer(self.basis.functions.T @ (np.stack(jacobians) * factor[:, None, :]))

    @cached_property
    def prior(self) -> tuple[Array, Array]:
        """Mean and standard deviation of the prior of the internal coordinates, shape (n, p) each."""
        count = len(self.parameters)
        mean, prior_std = np.zeros((2, len(self.top_speed), count))
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
        return np.where(self.having, mean, self.neutral), np.where(self.having, prior_std, FIXED)

    def shapes(self) -> Iterator[list[dict[str, float]]]:
        """Yield two sets of nonlinear parameters to start from, each by joint: scales at low and at higher speeds."""
        nonlinear = [parameter for parameter in self.law.parameters if parameter.starts]
        for place in (1 / 3, 2 / 3):
            yield [
                {
                    p.name: float(np.quantile(p.starts, place, method="nearest") * speed**p.start_speed_power)
                    for p in nonlinear
                }
                for speed in self.top_speed
            ]

    def linear_start(self, shapes: list[dict[str, float]], information: Array, right: Array) -> Array:
        """Return internal coordinates, shape (n, p), of a linear fit of all joints with given nonlinear parameters."""
        velocities = zip(self.basis.velocity, shapes, strict=True)
        bases = [self.basis.coefficients(self.law.basis(v, shape)) for v, shape in velocities]
        joints, size = len(bases), bases[0].shape[1]
        whole = block_diag(*bases)
        matrix, vector = whole.T @ information @ whole, whole.T @ right
        ridge = 1e-6 * np.diag(matrix) + 1e-9 * float(np.max(np.diag(matrix)))
        coefficients = np.linalg.solve(matrix + np.diag(ridge), vector).reshape(joints, size)
        free = list(self.law.free_coefficients)
        bounded = [k for k in range(size) if k not in free]
        least = 1e-2 * self.torque[:, None]
        coefficients[:, bounded] = np.maximum(coefficients[:, bounded], least)
        values = np.stack([self.law.from_linear(np.asarray(c), s) for c, s in zip(coefficients, shapes, strict=True)])
        return self.inside(values)

    def inside(self, values: Array) -> Array:
        """Return internal coordinates within their bounds, shape (n, p), from values of the law, shape (n, p)."""
        low, high = self.bounds
        return np.clip(to_internal(values, self.logarithmic), low, high)


def neutral_value(parameter: Parameter) -> float:
    """Return the value of a joint that does without a parameter; nan if none may."""
    return float("nan") if parameter.neutral is None else parameter.neutral
