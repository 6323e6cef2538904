"""The torque that resists the motion of a joint, at the speeds at which it is judged, with its derivatives."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.estimator.solver.fit import Fit
from stribeck.core.judgement.curve import SPEEDS


@dataclass(frozen=True, eq=False)
class Resisting:
    """Mean of both directions of a joint's friction at the `SPEEDS`."""

    fit: Fit
    joint: int

    @cached_property
    def odd(self) -> Array:
        """Derivatives by the coefficients of the basis, shape (3, R)."""
        return self.fit.laws.basis.odd(self.joint, self.fit.laws.top_speed[self.joint] * np.array([*SPEEDS.values()]))

    @cached_property
    def slopes(self) -> Array:
        """Derivatives by the joint's coordinates, shape (3, w)."""
        jacobian = self.fit.laws.of([self.joint]).jacobians(self.fit.internal[[self.joint]])[0]
        return np.asarray(self.odd @ jacobian[: self.odd.shape[1]])

    @property
    def size(self) -> float:
        """Largest torque [N m]."""
        theta = self.fit.laws.coefficients(self.fit.internal)[self.joint]
        return float(np.abs(self.odd @ theta[: self.odd.shape[1]]).max())

    def variance(self, covariance: Array) -> Array:
        """Compute the variances [N^2 m^2], shape (3,), from the covariance of all coordinates, shape (m, m)."""
        places = self.fit.layout.joint(self.joint)
        return np.asarray(np.einsum("sp,pq,sq->s", self.slopes, covariance[places, places], self.slopes))
