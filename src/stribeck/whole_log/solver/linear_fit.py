"""Linear fits to groups of whitened windows, for the pilot."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from stribeck.base.typing import Array
from stribeck.whole_log.model.corrections import ModelCorrections, Slopes
from stribeck.whole_log.noise.likelihood import Groups
from stribeck.whole_log.noise.outliers import Prediction
from stribeck.whole_log.noise.variance_components import VarianceComponents
from stribeck.whole_log.solver.elimination import inverse_of


def predict(
    groups: list[Groups], components: VarianceComponents, model: ModelCorrections, precision: Array
) -> tuple[Prediction, float]:
    """Fit some windows linearly, and divide the number of equations by their degrees of freedom [1].

    Friction has a prior with mean zero and this `precision`, shape (n q,); bodies are linearized at the model.
    """
    count = sum(each.count for each in groups)
    f, slopes = len(precision), model.slopes(np.zeros(model.layout.size))
    information, right = _normal_equations(product_of([each.whitened(components) for each in groups]), model, precision)
    covariance = inverse_of(information)
    values = covariance @ right
    known = len(values) - np.sum(np.diag(covariance)[:f] * precision) - np.sum(model.precision * covariance[f:, f:])
    covariance[f:] = slopes.pushed(covariance[f:])
    covariance[:, f:] = slopes.pushed(covariance[:, f:].T).T
    values[f:] = slopes.pushed(values[f:, None])[:, 0]
    return Prediction(values, covariance, components), count / max(count - known, 1.0)


def product_of(whitened: Sequence[Array]) -> Array:
    """Compute the products of the columns of some whitened groups, shape (D + 1, D + 1)."""
    rows = np.concatenate([each.reshape(-1, each.shape[-1]) for each in whitened])
    return np.asarray(rows.T @ rows)


def _normal_equations(product: Array, model: ModelCorrections, precision: Array) -> tuple[Array, Array]:
    """Compute information and right side for friction coefficients and correction coordinates, with the prior."""
    product = _in_coordinates(product, model.slopes(np.zeros(model.layout.size)), len(precision))
    pull = np.append(np.zeros(len(precision)), model.precision @ model.prior_mean)
    return product[:-1, :-1] + block_diag(np.diag(precision), model.precision), product[:-1, -1] + pull


def fitted(product: Array, model: ModelCorrections, precision: Array) -> Array:
    """Fit whitened groups linearly by their product; return the values, then -1 for the left side."""
    information, right = _normal_equations(product, model, precision)
    values = inverse_of(information) @ right
    values[len(precision) :] = model.slopes(np.zeros(model.layout.size)).pushed(values[len(precision) :, None])[:, 0]
    return np.append(values, -1.0)


def held_out(
    products: Array, counts: NDArray[np.int64], own: NDArray[np.int64], model: ModelCorrections, precision: Array
) -> Array:
    """Compute chi^2 per equation of some segments [1], each predicted by a fit to the others, shape (S,).

    Parameters
    ----------
    products, counts
        Products of the whitened columns of all segments, shape (G, D + 1, D + 1), and their numbers of equations.
    own
        Indices of these segments, shape (S,).
    model, precision
        Corrections, and prior precision of the friction coefficients.
    """
    together = products[own].sum(axis=0)
    values = (fitted(together - products[k], model, precision) for k in own)
    return np.array([each @ products[k] @ each for k, each in zip(own, values, strict=True)]) / np.maximum(
        counts[own], 1
    )


def _in_coordinates(product: Array, slopes: Slopes, friction: int) -> Array:
    """Convert products of values and left sides, shape (D + 1, D + 1), from corrections to their coordinates."""
    found = product.copy()
    found[friction:-1] = slopes.pulled(found[friction:-1])
    found[:, friction:-1] = slopes.pulled(found[:, friction:-1].T).T
    return found


def residuals(groups: list[Groups], values: Array) -> list[tuple[Groups, Array]]:
    """Compute the residuals, shape (g, b), of the groups' equations at values, shape (D + 1,), the last being -1."""
    return [(each, -each.design @ values) for each in groups]
