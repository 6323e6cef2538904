"""Rows of the equation of motion per sample, linear in inertial parameters and friction (docs/other-methods.md)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array

ROOT = 6
"""Unknowns of a floating root [1]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class DirectRows:
    """K samples of m rows in one contact mode.

        left = columns (pi - pi_0, beta) + effects^T f + error

    Attributes
    ----------
    left
        Torque less the model's inverse dynamics [N m], shape (K, m).
    columns
        Its derivatives by the inertial parameters pi of L bodies, then columns of the q friction coefficients beta,
        shape (K, m, 10 L + q).
    effects
        What u unknowns f of each sample do to the rows, shape (K, u, m): on a floating base the acceleration by which
        its root does not stand still, then contact forces; none on a fixed one.
    used
        Rows that count, shape (K, m): in the others a joint is at rest, and its friction not known.
    kind
        Which standard deviation each row has, shape (m,).
    clusters
        Numbers of two clusters that each sample is in, whose samples' errors are correlated, shape (2, K): its block, a
        step or a second; and its phase of the gait, as what the contacts do wrong comes again in every step. Without a
        gait the second is -1.
    """

    left: Array
    columns: Array
    effects: Array
    used: NDArray[np.bool_]
    kind: NDArray[np.int64]
    clusters: NDArray[np.int64]

    def weights(self, scale: Array, root_std: Array) -> Weights:
        """Return the weights of rows that are scaled by D = diag(scale), shape (K, m), zero where they do not count.

        The unknowns are random effects: the root's acceleration has standard deviations [m/s^2], [rad/s^2], shape (6,),
        a contact force an infinite one. With U = D effects^T, in units of these, and L their precision,
        W = D (I - U P U^T) D with P = (U^T U + L)^-1 is the rows' inverse covariance.
        """
        count = self.effects.shape[1]
        unit = np.append(root_std, np.ones(count))[:count]
        precision = np.where(np.arange(count) < ROOT, 1.0, 0.0)
        response = scale[:, :, None] * (self.effects * unit[:, None]).transpose(0, 2, 1)
        squares = response.transpose(0, 2, 1) @ response + np.diag(precision)
        size = np.sqrt(np.diagonal(squares, axis1=1, axis2=2))[:, :, None]
        size = np.where(size > 0, size, 1.0)  # of a force that no row feels
        values, vectors = np.linalg.eigh(squares / (size * size.transpose(0, 2, 1)))  # ranks are no matter of units
        # smaller ones are of feet that constrain the same twice
        kept = values > 1e-12 * values.max(axis=1, keepdims=True, initial=0.0)
        root = vectors / size * np.where(kept, 1 / np.sqrt(np.where(kept, values, 1.0)), 0.0)[:, None]
        return Weights(scale, response @ root, root)


@dataclass(frozen=True, eq=False)
class Weights:
    """D, shape (K, m), Q = U R, shape (K, m, u), and R with R R^T = P, shape (K, u, u), of `DirectRows.weights`.

    Where the root's acceleration explains nearly all of a row, U P U^T is rounded by more than what that leaves of the
    row; Q Q^T is not.
    """

    scale: Array
    explained: Array
    root: Array

    def apply(self, columns: Array) -> Array:
        """Return W times columns, shape (K, m, c)."""
        scaled = self.scale[:, :, None] * columns
        common = self.explained.transpose(0, 2, 1) @ scaled
        return np.asarray(self.scale[:, :, None] * (scaled - self.explained @ common))

    def residuals(self, left: Array) -> tuple[Array, Array, Array]:
        """Return scaled residuals without the most likely effects, the variance of these, and the effects' squares.

        Of what is left of the left side, shape (K, m): shapes (K, m), (K, m), and the mean squares (K, u), in units of
        their standard deviations, by which variances converge (expectation maximisation).
        """
        scaled = self.scale * left
        common = self.explained.transpose(0, 2, 1) @ scaled[:, :, None]
        squares = (self.root @ common)[:, :, 0] ** 2 + np.sum(self.root**2, axis=2)
        return scaled - (self.explained @ common)[:, :, 0], np.sum(self.explained**2, axis=2), squares
