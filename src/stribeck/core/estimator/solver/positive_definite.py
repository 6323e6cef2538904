"""Inverses of positive definite matrices."""

import numpy as np

from stribeck.core.base.typing import Array


def inverse_of(matrix: Array) -> Array:
    """Invert a positive definite matrix whose rows may have very different units.

    Eigenvalues below the rounding error are raised to it, because rounding can cancel the prior's share.
    """
    from scipy.linalg.lapack import dpotri

    if not len(matrix):
        return np.zeros((0, 0))
    scale, factor, failed = _factor(matrix)
    if not failed:
        half = dpotri(factor, lower=1, overwrite_c=1)[0]
        inverse = half + half.T
        np.einsum("ii->i", inverse)[:] /= 2
    else:
        values, vectors = np.linalg.eigh(matrix * np.outer(scale, scale))
        inverse = (vectors / np.maximum(values, np.finfo(float).eps * values[-1])) @ vectors.T
    inverse *= np.outer(scale, scale)
    return np.asarray(inverse)


def solution_of(matrix: Array, right: Array) -> Array:
    """Solve positive definite equations with one right side, as by `inverse_of`."""
    from scipy.linalg.lapack import dpotrs

    scale, factor, failed = _factor(matrix)
    return inverse_of(matrix) @ right if failed else scale * dpotrs(factor, scale * right, lower=1)[0]


def _factor(matrix: Array) -> tuple[Array, Array, int]:
    """Scale the rows and columns of a matrix, and factor it into a lower triangle; return the scale, too."""
    from scipy.linalg.lapack import dpotrf

    scale = 1 / np.sqrt(np.maximum(np.abs(np.diag(matrix)), np.finfo(float).tiny))
    scaled = matrix * np.outer(scale, scale)
    return scale, *dpotrf(scaled.T, lower=1, overwrite_a=1)  # symmetric: in LAPACK's order, nothing is copied
