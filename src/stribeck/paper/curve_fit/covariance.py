"""Covariance and intervals of fitted parameters for samples that are correlated within blocks."""

import itertools
from dataclasses import dataclass

import numpy as np

from stribeck.core.base.typing import Array, IntArray

ROUNDING = 1e-13
"""Smallest significant eigenvalue relative to the largest [1]; smaller ones are rounding."""


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Covariance, shape (p, p), and degrees of freedom of each parameter, shape (p,)."""

    covariance: Array
    degrees_of_freedom: Array


def block_covariance(jacobian: Array, residual: Array, block: IntArray, prior: Array) -> Uncertainty:
    """Compute the block-robust covariance of a least squares estimate by the linearized jackknife (CR3).

    Samples of one block may be correlated in any way; blocks are independent. With J_b, r_b of block b,
    A_b = J_b^T J_b, g_b = J_b^T r_b and s^2 the residual variance,

        A   = sum A_b + s^2 diag(prior)^-2
        d_b = (A - A_b)^-1 g_b                                   change if block b is left out
        C   = (B - 1) / B sum d_b d_b^T + A^-1 s^2 diag(prior)^-2 s^2 A^-1

    The prior is wide enough to matter only for parameters without influence on the samples. Degrees of freedom are
    Satterthwaite's, from the distribution of a parameter's information over the blocks.

    Parameters
    ----------
    jacobian
        Derivatives of the model with respect to the parameters, shape (N, p).
    residual
        Residual [N m], shape (N,).
    block
        Block of each sample, ascending, shape (N,).
    prior
        Prior standard deviation of each parameter, shape (p,).
    """
    first = np.flatnonzero(np.r_[True, block[1:] != block[:-1]])
    edges = np.r_[first, len(block)]
    pairs = list(itertools.pairwise(edges))
    scaled = jacobian * prior  # in units of the prior, which becomes the identity
    information = np.stack([scaled[i:k].T @ scaled[i:k] for i, k in pairs])
    scores = np.stack([scaled[i:k].T @ residual[i:k] for i, k in pairs])
    variance = max(float(np.mean(residual**2)), ROUNDING**2 * float(np.max(information.trace(axis1=1, axis2=2))))
    if variance == 0:  # neither residual nor derivative contains information
        return Uncertainty(np.diag(prior**2), np.ones(len(prior)))
    uncertainty = jackknife(information / variance, scores / variance)
    return Uncertainty(uncertainty.covariance * np.outer(prior, prior), uncertainty.degrees_of_freedom)


def jackknife(information: Array, scores: Array) -> Uncertainty:
    """Compute C of `block_covariance` in coordinates in which the prior's covariance is the identity.

    `information` is A_b / s^2, shape (B, p, p), and `scores` is g_b / s^2, shape (B, p).
    """
    total = information.sum(axis=0) + np.eye(scores.shape[1])
    inverse = inverses(total[None])[0]
    left_out = inverses(total - information)
    changes = np.einsum("bij,bj->bi", left_out, scores)
    blocks = len(information)
    covariance = (blocks - 1) / blocks * changes.T @ changes + inverse @ inverse
    # rounding must not make a share negative for parameters without information
    shares = np.maximum(np.sum((inverse @ information) * inverse, axis=2), 0.0)
    shares /= np.maximum(shares.sum(axis=0), np.finfo(float).tiny)
    freedom = 1 / np.maximum((shares**2).sum(axis=0), 1 / blocks) - 1
    return Uncertainty(covariance, np.maximum(freedom, 1.0))


def inverses(matrices: Array) -> Array:
    """Invert positive definite matrices with eigenvalues of at least 1, shape (B, p, p)."""
    scale = 1 / np.sqrt(np.maximum(np.diagonal(matrices, axis1=1, axis2=2), 1.0))
    correlation = matrices * scale[:, :, None] * scale[:, None, :]
    eigenvalues, vectors = np.linalg.eigh(correlation)
    eigenvalues = np.maximum(eigenvalues, ROUNDING * eigenvalues[:, -1:])
    inverse = (vectors / eigenvalues[:, None, :]) @ np.swapaxes(vectors, 1, 2)
    return np.asarray(inverse * scale[:, :, None] * scale[:, None, :])
