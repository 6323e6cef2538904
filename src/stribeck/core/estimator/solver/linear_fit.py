"""Linear fits to groups of whitened windows, for the pilot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy  # its linalg is slow to import: loaded at its first use

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.equations.weak_equations import WeakEquations
from stribeck.core.estimator.model.corrections import ModelCorrections
from stribeck.core.estimator.noise.likelihood import Groups
from stribeck.core.estimator.noise.outliers import Prediction
from stribeck.core.estimator.noise.variance_components import VarianceComponents
from stribeck.core.estimator.solver.positive_definite import inverse_of, solution_of


@dataclass(frozen=True, eq=False)
class LinearFit:
    """A linear fit to groups of windows, the pilot; results that several of its steps use are computed once.

    Attributes
    ----------
    groups
        Groups of each segment, G in all, with derivatives by coefficients and by coordinates of the corrections.
    components
        Standard deviations of the errors.
    model
        Corrections, linearized at zero.
    precision
        Prior precision of the friction coefficients, whose mean is zero, shape (n q,).
    delay
        Delay by which the torques are shifted [s].
    by_joint
        Columns of friction of each segment, shape (K, n, q).
    """

    groups: list[Groups]
    components: VarianceComponents
    model: ModelCorrections
    precision: Array
    delay: float
    by_joint: list[Array]

    @property
    def parts(self) -> list[WeakEquations]:
        """Equations of the segments."""
        return [group.part for group in self.groups]

    def prior(self, model: ModelCorrections) -> tuple[Array, Array]:
        """Compute the prior's inverse covariance, shape (D, D), and its product with the mean, shape (D,).

        `model` are the same corrections, possibly with another prior.
        """
        pull = np.append(np.zeros(len(self.precision)), model.precision @ model.prior_mean)
        return scipy.linalg.block_diag(np.diag(self.precision), model.precision), pull

    @cached_property
    def counts(self) -> IntArray:
        """Number of equations of each segment that count, shape (G,)."""
        return np.array([group.count for group in self.groups])

    @cached_property
    def whiteners(self) -> list[Array]:
        """Whitener of each segment's groups, shape (g, b, b)."""
        return [group.whitener(self.components) for group in self.groups]

    def whitened(self) -> Iterator[Array]:
        """Compute the whitened columns of each segment, shape (g, b, D + 1)."""
        return (whitener @ group.design for whitener, group in zip(self.whiteners, self.groups, strict=True))

    @cached_property
    def products(self) -> Array:
        """Products of the whitened columns of each segment, shape (G, D + 1, D + 1)."""
        return np.stack([product_of(columns) for columns in self.whitened()])

    @cached_property
    def covariance(self) -> Array:
        """Covariance of coefficients and coordinates, shape (D, D)."""
        return inverse_of(self.products.sum(axis=0)[:-1, :-1] + self.prior(self.model)[0])

    @cached_property
    def values(self) -> Array:
        """Coefficients, coordinates, and -1, shape (D + 1,)."""
        return np.append(self.covariance @ (self.products.sum(axis=0)[:-1, -1] + self.prior(self.model)[1]), -1.0)

    @property
    def usual(self) -> float:
        """Median chi^2 per equation of the segments that are not set aside [1], at least 0.1: logs may be exact."""
        used = self.counts > 0
        sizes = (self.products[used] @ self.values @ self.values) / self.counts[used]
        return max(0.1, float(np.median(sizes))) if used.any() else 1.0

    @cached_property
    def prediction(self) -> Prediction:
        """Prediction of coefficients and corrections."""
        values, covariance = self.values[:-1].copy(), self.covariance.copy()
        slopes, places = self.model.slopes(np.zeros(self.model.layout.size)), slice(len(self.precision), None)
        values[places] = slopes.pushed(values[places, None])[:, 0]
        covariance[places] = slopes.pushed(covariance[places])
        covariance[:, places] = slopes.pushed(covariance[:, places].T).T
        return Prediction(values, covariance, self.components, self.usual)

    @property
    def late(self) -> tuple[float, float]:
        """Remaining delay of the torques, and its standard error [s]; zeros if the delay is not corrected."""
        places = len(self.precision) + self.model.layout.places("torque_delay")
        variance = self.prediction.covariance[places, places]
        return float(self.prediction.values[places].sum()), float(np.sqrt(variance).sum())

    def held_out(self, segments: IntArray, model: ModelCorrections) -> Array:
        """Compute chi^2 per equation of some segments [1], each predicted by a fit to the others, shape (S,)."""
        together, prior = self.products[segments].sum(axis=0), self.prior(model)
        values = [fitted(together - self.products[k], *prior) for k in segments]
        squares = [vector @ self.products[k] @ vector for k, vector in zip(segments, values, strict=True)]
        return np.asarray(np.array(squares) / np.maximum(self.counts[segments], 1))


def fitted(product: Array, precision: Array, pull: Array) -> Array:
    """Fit whitened groups by the product of their columns and a prior; return coefficients, coordinates, and -1."""
    return np.append(solution_of(product[:-1, :-1] + precision, product[:-1, -1] + pull), -1.0)


def product_of(whitened: Array) -> Array:
    """Compute the products of the columns of whitened groups, shape (g, b, D + 1) -> (D + 1, D + 1)."""
    rows = whitened.reshape(-1, whitened.shape[-1])
    return np.asarray(rows.T @ rows)


def residuals(groups: Sequence[Groups], values: Array) -> list[Array]:
    """Compute the residual of each segment's groups, shape (g, b), at values, shape (D + 1,), the last being -1."""
    return [-group.design @ values for group in groups]
