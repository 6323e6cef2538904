"""Covariance of fitted parameters when samples are correlated within blocks, and the intervals it gives."""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit  # of scipy.stats, which is slow to import

from stribeck.base.typing import Array

ROUNDING = 1e-13
"""Smallest eigenvalue that counts, relative to the largest [1]: below it the sum of squares is rounding."""


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Covariance, shape (p, p), and degrees of freedom of each parameter, shape (p,)."""

    covariance: Array
    degrees_of_freedom: Array


def block_covariance(jacobian: Array, residual: Array, block: NDArray[np.int64], prior: Array) -> Uncertainty:
    """Return the block-robust covariance of a least squares estimate, by the linearised jackknife (CR3).

    Samples of one block may be correlated in any way, blocks are independent. With J_b, r_b of block b,
    A_b = J_b^T J_b, g_b = J_b^T r_b and s^2 the residual variance,

        A   = sum A_b + s^2 diag(prior)^-2
        d_b = (A - A_b)^-1 g_b                                   what leaving block b out changes
        C   = (B - 1) / B sum d_b d_b^T + A^-1 s^2 diag(prior)^-2 s^2 A^-1

    The prior is so wide that it only speaks where the samples say nothing: a parameter without any influence gets
    the prior's standard deviation instead of a division by zero. Degrees of freedom are Satterthwaite's, from how
    evenly the blocks share in what is known of a parameter.

    Parameters
    ----------
    jacobian
        Shape (N, p).
    residual
        [N m], shape (N,).
    block
        Shape (N,), ascending.
    prior
        Standard deviation of each parameter before any sample was seen, shape (p,).
    """
    first = np.flatnonzero(np.r_[True, block[1:] != block[:-1]])
    edges = np.r_[first, len(block)]
    pairs = list(itertools.pairwise(edges))
    scaled = jacobian * prior  # in units of the prior, so that the prior is the identity
    information = np.stack([scaled[i:k].T @ scaled[i:k] for i, k in pairs])
    scores = np.stack([scaled[i:k].T @ residual[i:k] for i, k in pairs])
    variance = max(float(np.mean(residual**2)), ROUNDING**2 * float(np.max(information.trace(axis1=1, axis2=2))))
    if variance == 0:  # neither a residual nor a derivative: nothing at all is known
        return Uncertainty(np.diag(prior**2), np.ones(len(prior)))
    found = jackknife(information / variance, scores / variance)
    return Uncertainty(found.covariance * np.outer(prior, prior), found.degrees_of_freedom)


def jackknife(information: Array, scores: Array) -> Uncertainty:
    """Return the C of `block_covariance`, in coordinates in which the prior's covariance is the identity.

    `information` are the A_b over s^2, shape (B, p, p), and `scores` the g_b over s^2, shape (B, p).
    """
    total = information.sum(axis=0) + np.eye(scores.shape[1])
    inverse = inverses(total[None])[0]
    left_out = inverses(total - information)
    changes = np.einsum("bij,bj->bi", left_out, scores)
    blocks = len(information)
    covariance = (blocks - 1) / blocks * changes.T @ changes + inverse @ inverse
    # rounding must not make a share negative where the samples say nothing of a parameter
    shares = np.maximum(np.sum((inverse @ information) * inverse, axis=2), 0.0)
    shares /= np.maximum(shares.sum(axis=0), np.finfo(float).tiny)
    freedom = 1 / np.maximum((shares**2).sum(axis=0), 1 / blocks) - 1
    return Uncertainty(covariance, np.maximum(freedom, 1.0))


def inverses(matrices: Array) -> Array:
    """Return the inverses of positive definite matrices, shape (B, p, p), whose eigenvalues are at least 1."""
    scale = 1 / np.sqrt(np.maximum(np.diagonal(matrices, axis1=1, axis2=2), 1.0))
    correlation = matrices * scale[:, :, None] * scale[:, None, :]
    eigenvalues, vectors = np.linalg.eigh(correlation)
    eigenvalues = np.maximum(eigenvalues, ROUNDING * eigenvalues[:, -1:])
    inverse = (vectors / eigenvalues[:, None, :]) @ np.swapaxes(vectors, 1, 2)
    return np.asarray(inverse * scale[:, :, None] * scale[:, None, :])


def intervals_95(values: Array, deviation: Array, freedom: Array, logarithmic: NDArray[np.bool_]) -> Array:
    """Return 95 % intervals, shape (p, 2).

    `deviation` is the standard error of each parameter, or of its logarithm where `logarithmic`.
    """
    half = stdtrit(freedom, 0.975) * deviation
    factor = np.exp(np.minimum(half, 100.0))
    lower = np.where(logarithmic, values / factor, values - half)
    upper = np.where(logarithmic, values * factor, values + half)
    return np.column_stack([lower, upper])
