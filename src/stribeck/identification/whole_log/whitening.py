"""Covariance of a stretch's equations, and the triangular factor that makes their errors independent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dtrtri

from stribeck.equations import WeakEquations
from stribeck.identification.whole_log.fading import fading
from stribeck.identification.whole_log.levels import ErrorLevels
from stribeck.log import Array


@dataclass(frozen=True, eq=False)
class Whitener:
    """The inverse Cholesky factor of a block-tridiagonal covariance, block by block.

    Attributes
    ----------
    inverse
        Inverse of the factor's diagonal blocks, shape (B, b, b).
    coupling
        The factor's blocks below the diagonal, shape (B, b, b); the first is zero.
    """

    inverse: Array
    coupling: Array

    def apply(self, rows: Array) -> Array:
        """Return whitened rows, shape (r, c) -> (B b, c); rows that are missing to full blocks are zero."""
        blocks, size = self.inverse.shape[:2]
        white = np.zeros((blocks * size, rows.shape[1]))
        white[: len(rows)] = rows
        for k, (inverse, coupling) in enumerate(zip(self.inverse, self.coupling, strict=True)):
            here = slice(k * size, (k + 1) * size)
            if k:
                white[here] -= coupling @ white[(k - 1) * size : k * size]
            white[here] = inverse @ white[here]
        return white


def make_whitener(equations: WeakEquations, levels: ErrorLevels) -> Whitener:
    """Return the whitener of a stretch, given the levels of the errors that no sensor makes."""
    blocks = _covariance(equations, levels)
    count, size = blocks.shape[:2]
    inverse, coupling = np.zeros((2, count, size, size))
    for k in range(count):
        diagonal = blocks[k, :, size:]
        if k:
            coupling[k] = blocks[k, :, :size] @ inverse[k - 1].T
            diagonal = diagonal - coupling[k] @ coupling[k].T
        inverse[k] = dtrtri(np.linalg.cholesky(diagonal), lower=1)[0]
    return Whitener(inverse, coupling)


def _covariance(equations: WeakEquations, levels: ErrorLevels) -> Array:
    """Return blocks [left of the diagonal, diagonal], shape (B, b, 2 b), lower triangle, of windows in groups."""
    windows, rows = equations.residual.shape
    lags = len(equations.torque_overlap) - 1
    count = -(-windows // lags)
    blocks = np.zeros((count, lags, rows, 2 * lags, rows))
    response = equations.encoder_response * equations.encoder_noise
    torque = equations.weights * equations.torque_noise
    shape = fading(lags)
    drift = levels.response(equations) * levels.at(equations)[:, None]
    window = np.arange(count * lags)
    for lag in range(lags + 1):
        late, early = slice(lag, windows), slice(0, windows - lag)
        if windows <= lag:
            break
        covariance = equations.acceleration_overlap[lag] * (response[late] @ response[early].transpose(0, 2, 1))
        covariance += equations.torque_overlap[lag] * (torque[late] @ torque[early].transpose(0, 2, 1))
        covariance += shape[lag] * (drift[late] @ drift[early].transpose(0, 2, 1))
        k = window[lag:windows]
        group = k // lags
        blocks[group, k % lags, :, k - lag - lags * (group - 1), :] = covariance
    for k in window[windows:]:  # rows that fill the last block up
        blocks[-1, k % lags, :, lags + k % lags, :] = np.eye(rows)
    return blocks.reshape(count, lags * rows, 2 * lags * rows)
