"""Linear fits to groups of whitened windows, for the pilot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy  # its linalg is slow to import: loaded at its first use
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.core.estimator.model.corrections import ModelCorrections, Slopes
from stribeck.core.estimator.noise.likelihood import Groups
from stribeck.core.estimator.noise.outliers import Prediction
from stribeck.core.estimator.noise.variance_components import VarianceComponents
from stribeck.core.estimator.solver.positive_definite import inverse_of, solution_of


@dataclass(frozen=True, eq=False)
class LinearModel:
    """Coefficients of friction, with a prior of mean zero, and coordinates of corrections, linearized at zero.

    Attributes
    ----------
    slopes
        Derivatives of the corrections by their coordinates.
    precision, pull
        Inverse covariance of the prior, shape (D, D), and its product with the prior's mean, shape (D,).
    """

    slopes: Slopes
    precision: Array
    pull: Array

    @classmethod
    def of(cls, model: ModelCorrections, precision: Array) -> LinearModel:
        """Linearize a model; friction has this prior `precision`, shape (n q,)."""
        pull = np.append(np.zeros(len(precision)), model.precision @ model.prior_mean)
        slopes = model.slopes(np.zeros(model.layout.size))
        return cls(slopes, scipy.linalg.block_diag(np.diag(precision), model.precision), pull)

    @property
    def corrections(self) -> slice:
        """Places of the corrections among all D values."""
        return slice(len(self.pull) - len(self.slopes), len(self.pull))

    def in_coordinates(self, product: Array) -> Array:
        """Convert products of values and left sides, shape (D + 1, D + 1), from corrections to their coordinates."""
        result, places = product.copy(), self.corrections
        result[places] = self.slopes.pulled(result[places])
        result[:, places] = self.slopes.pulled(result[:, places].T).T
        return result

    def information(self, product: Array) -> tuple[Array, Array]:
        """Compute information and right side, with the prior, from products in coordinates."""
        return product[:-1, :-1] + self.precision, product[:-1, -1] + self.pull

    def fitted(self, product: Array) -> Array:
        """Fit whitened groups by their product in coordinates; return coefficients, coordinates, and -1."""
        return np.append(solution_of(*self.information(product)), -1.0)

    def values(self, fitted: Array) -> Array:
        """Convert coordinates among D values or more to corrections."""
        result, places = fitted.copy(), self.corrections
        result[places] = self.slopes.pushed(result[places, None])[:, 0]
        return result


def predict(
    groups: list[Groups], components: VarianceComponents, model: ModelCorrections, precision: Array
) -> tuple[Prediction, float]:
    """Fit some windows linearly, and divide the number of equations by their degrees of freedom [1].

    Friction has a prior with mean zero and this `precision`, shape (n q,); bodies are linearized at the model.
    """
    linear, count = LinearModel.of(model, precision), sum(group.count for group in groups)
    product = product_of([group.whitened(components) for group in groups])
    information, right = linear.information(linear.in_coordinates(product))
    covariance = inverse_of(information)
    values = covariance @ right
    known, places = len(values) - np.sum(linear.precision * covariance), linear.corrections
    covariance[places] = linear.slopes.pushed(covariance[places])
    covariance[:, places] = linear.slopes.pushed(covariance[:, places].T).T
    return Prediction(linear.values(values), covariance, components), count / max(count - known, 1.0)


def product_of(whitened: Sequence[Array]) -> Array:
    """Compute the products of the columns of some whitened groups, shape (D + 1, D + 1)."""
    rows = np.concatenate([group.reshape(-1, group.shape[-1]) for group in whitened])
    return np.asarray(rows.T @ rows)


def products_of(groups: Sequence[Groups], components: VarianceComponents, linear: LinearModel) -> Array:
    """Compute the products of each segment in coordinates, shape (G, D + 1, D + 1)."""
    return np.stack([linear.in_coordinates(product_of([group.whitened(components)])) for group in groups])


def held_out(products: Array, counts: NDArray[np.int64], segments: NDArray[np.int64], linear: LinearModel) -> Array:
    """Compute chi^2 per equation of some segments [1], each predicted by a fit to the others, shape (S,).

    Parameters
    ----------
    products, counts
        Products of all segments in coordinates, and their numbers of equations.
    segments
        Indices of these segments, shape (S,).
    linear
        Model of these fits.
    """
    together = products[segments].sum(axis=0)
    values = (linear.fitted(together - products[k]) for k in segments)
    return np.array([vector @ products[k] @ vector for k, vector in zip(segments, values, strict=True)]) / np.maximum(
        counts[segments], 1
    )


def residuals(groups: list[Groups], values: Array) -> list[tuple[Groups, Array]]:
    """Compute the residuals, shape (g, b), of the groups' equations at values, shape (D + 1,), the last being -1."""
    return [(group, -group.design @ values) for group in groups]
