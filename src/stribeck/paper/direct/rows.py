"""Rows of the equation of motion per sample, linear in inertial parameters and friction (docs/other-methods.md)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stribeck.core.base.typing import Array, BoolArray, IntArray

ROOT = 6
"""Number of a floating root's unknowns, and of its kinds of rows, which precede those of the joints."""


@dataclass(frozen=True, eq=False, kw_only=True)
class DirectRows:
    """K samples of m rows in one contact mode.

        left = columns (pi - pi_0, beta) + effects^T f + error

    Attributes
    ----------
    left
        Torque minus the model's inverse dynamics [N m], shape (K, m).
    columns
        Derivatives with respect to the inertial parameters pi of L bodies, then columns of the q friction coefficients
        beta, shape (K, m, 10 L + q).
    effects
        Effect of u unknowns f per sample on the rows, shape (K, u, m): for a floating base, the acceleration of its
        root and contact forces; none for a fixed base.
    used
        Mask of used rows, shape (K, m); in the others a joint is at rest and its friction unknown.
    kind
        Index of each row's standard deviation, shape (m,).
    clusters
        Two clusters of correlated errors per sample, shape (2, K): the block (step or second), and the phase of the
        gait, because contact errors repeat with every step. The latter is -1 without a gait.
    """

    left: Array
    columns: Array
    effects: Array
    used: BoolArray
    kind: IntArray
    clusters: IntArray

    def weights(self, scale: Array, root_std: Array) -> Weights:
        """Compute the weights of rows that are scaled by D = diag(scale), shape (K, m), zero for unused rows.

        The unknowns are random effects. The root's acceleration has standard deviations [m/s²], [rad/s²], shape (6,);
        contact forces have infinite ones. With U = D effects^T in these units, and L their precision, the inverse
        covariance of the rows is W = D (I - U P U^T) D with P = (U^T U + L)^-1.
        """
        count = self.effects.shape[1]
        unit = np.append(root_std, np.ones(count))[:count]
        precision = np.where(np.arange(count) < ROOT, 1.0, 0.0)
        response = scale[:, :, None] * (self.effects * unit[:, None]).transpose(0, 2, 1)
        squares = response.transpose(0, 2, 1) @ response + np.diag(precision)
        size = np.sqrt(np.diagonal(squares, axis1=1, axis2=2))[:, :, None]
        size = np.where(size > 0, size, 1.0)  # for forces without an effect on any row
        values, vectors = np.linalg.eigh(squares / (size * size.transpose(0, 2, 1)))  # the rank is independent of units
        # smaller ones result from redundant constraints of feet
        kept = values > 1e-12 * values.max(axis=1, keepdims=True, initial=0.0)
        root = vectors / size * np.where(kept, 1 / np.sqrt(np.where(kept, values, 1.0)), 0.0)[:, None]
        return Weights(scale, response @ root, root)


@dataclass(frozen=True, eq=False)
class Weights:
    """Factors of `DirectRows.weights`: D, shape (K, m), Q = U R, shape (K, m, u), R with R R^T = P, shape (K, u, u).

    If the root's acceleration explains nearly all of a row, rounding of U P U^T exceeds the rest of the row; rounding
    of Q Q^T does not.
    """

    scale: Array
    explained: Array
    root: Array

    def apply(self, columns: Array) -> Array:
        """Compute W times columns, shape (K, m, c)."""
        scaled = self.scale[:, :, None] * columns
        common = self.explained.transpose(0, 2, 1) @ scaled
        return np.asarray(self.scale[:, :, None] * (scaled - self.explained @ common))

    def residuals(self, residual: Array) -> tuple[Array, Array, Array]:
        """Subtract the most likely effects from scaled residuals of shape (K, m).

        Returns the remaining residuals and their variance, shape (K, m), and the mean squares of the effects in units
        of their standard deviations, shape (K, u), for expectation maximization of the variances.
        """
        scaled = self.scale * residual
        common = self.explained.transpose(0, 2, 1) @ scaled[:, :, None]
        squares = (self.root @ common)[:, :, 0] ** 2 + np.sum(self.root**2, axis=2)
        return scaled - (self.explained @ common)[:, :, 0], np.sum(self.explained**2, axis=2), squares
