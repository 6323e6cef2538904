"""Covariance of a segment's equations, and its inverse Cholesky factor (docs/estimator.md, equations 6, 9 and 10).

Block-tridiagonal factorization: Golub and Van Loan 2013, 4.5.
"""

from dataclasses import dataclass

import numpy as np
import scipy  # its linalg is slow to import: loaded at its first use

from stribeck.core.base.typing import Array
from stribeck.core.equations.weak_equations import WeakEquations
from stribeck.core.estimator.noise.variance_components import ErrorSource, VarianceComponents


@dataclass(frozen=True, eq=False)
class Whitener:
    """The inverse Cholesky factor of a block-tridiagonal covariance, block by block.

    A block contains as many windows as errors reach over, so that only neighboring blocks are correlated. A window is
    correlated with windows of the previous block that have a higher index in their block.

    Attributes
    ----------
    inverse
        Inverse of the factor's diagonal blocks, shape (B, b, b): lower triangular.
    coupling
        Blocks of the factor below the diagonal, shape (B, b, b): upper triangular, window by window; the first is zero.
    """

    inverse: Array
    coupling: Array

    def whiten(self, rows: Array) -> None:
        """Whiten contiguous rows in place, shape (K m, c), block by block."""
        blas, size = scipy.linalg.blas, self.inverse.shape[1]
        for k, (inverse, coupling) in enumerate(zip(self.inverse, self.coupling, strict=True)):
            before, block = rows[max(k - 1, 0) * size : k * size], rows[k * size : (k + 1) * size]
            count = len(block)
            if k:
                blas.dgemm(-1.0, before.T, coupling[:count].T, 1.0, block.T, overwrite_c=1)
            blas.dtrmm(1.0, inverse[:count, :count].T, block.T, side=1, overwrite_b=1)

    def whiten_back(self, rows: Array) -> None:
        """Multiply whitened rows, shape (K m, c), by the transposed whitener in place: Sigma^-1 times the rows."""
        blas, size, last = scipy.linalg.blas, self.inverse.shape[1], len(self.inverse) - 1
        for k in range(last, -1, -1):
            block, after = rows[k * size : (k + 1) * size], rows[(k + 1) * size : (k + 2) * size]
            count = len(block)
            if k < last:
                coupling = self.coupling[k + 1, : len(after)]
                blas.dgemm(-1.0, after.T, coupling.T, 1.0, block.T, trans_b=1, overwrite_c=1)
            blas.dtrmm(1.0, self.inverse[k, :count, :count].T, block.T, side=1, trans_a=1, overwrite_b=1)


def make_whitener(equations: WeakEquations, components: VarianceComponents) -> Whitener:
    """Compute the whitener of a segment from the variance components."""
    windows, rows = equations.residual.shape
    lags = equations.lags
    count, size = -(-windows // lags), lags * rows
    sources, every, first, last = components.by_groups(equations), slice(None), slice(-1), slice(1, None)
    within, between = covariance_of_groups(sources, 0, every, every), covariance_of_groups(sources, 1, last, first)
    filled = windows * rows - (count - 1) * size
    within[-1, range(filled, size), range(filled, size)] = 1.0  # rows that fill the last block up
    inverse, coupling = np.zeros((2, count, size, size))
    for k, diagonal in enumerate(within):
        if k:
            np.matmul(between[k - 1], inverse[k - 1].T, out=coupling[k])
            diagonal -= coupling[k] @ coupling[k].T
        inverse[k] = scipy.linalg.lapack.dtrtri(np.linalg.cholesky(diagonal), lower=1)[0]
    return Whitener(inverse, coupling)


def covariance_of_groups(sources: list[ErrorSource], apart: int, later_groups: slice, earlier_groups: slice) -> Array:
    """Compute the covariances of late groups with early groups at a distance of `apart` groups, shape (B, b, b)."""
    parts = [source.response[later_groups] @ source.response[earlier_groups].transpose(0, 2, 1) for source in sources]
    for part, source in zip(parts, sources, strict=True):
        part *= source.correlation[apart]
    for part in parts[1:]:
        parts[0] += part
    return parts[0]
