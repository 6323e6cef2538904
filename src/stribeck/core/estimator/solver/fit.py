"""A fit of all laws and corrections at once: coordinates, their covariance, and derived quantities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.core.equations.whole_log.corrections.correction import Layout
from stribeck.core.estimator.model.corrections import ModelCorrections
from stribeck.core.estimator.model.laws import Laws
from stribeck.core.estimator.solver.statistics import Statistics


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
        return self.model.layout.with_friction(*self.internal.shape)

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
        hessian = self.pulled(self.pulled(statistics.information).T)
        n = self.internal.size
        hessian[range(n), range(n)] += self.laws.prior[1].ravel() ** -2.0
        hessian[n:, n:] += self.model.precision
        return hessian
