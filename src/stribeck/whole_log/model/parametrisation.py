"""Coefficients theta(u) of friction curves and corrections, their derivatives J, and the prior of u.

In the code u is x, and theta is y: docs/estimator.md, "Coordinates and priors", equations (16) and (17).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag

from stribeck.base.typing import Array
from stribeck.whole_log.model.friction_curves import Curves
from stribeck.whole_log.model.layout import ModelLayout
from stribeck.whole_log.model.model_corrections import ModelCorrections


@dataclass(frozen=True, eq=False)
class Parametrisation:
    """Values y(x) that a log is linear in, their derivatives J(x), and the prior, of x in the order of `layout`."""

    curves: Curves
    model: ModelCorrections

    @property
    def layout(self) -> ModelLayout:
        """Of the m coordinates x."""
        return self.model.layout.beside(len(self.curves.top_speed), len(self.curves.parameters))

    def internal(self, x: Array) -> Array:
        """Return the internal coordinates of the laws' parameters, shape (n, p)."""
        return x[self.layout.friction].reshape(self.layout.joints, -1)

    def values(self, x: Array) -> Array:
        """Return y: coefficients of all friction curves, then corrections, shape (D,)."""
        corrected = self.model.values(x[self.layout.model])
        return np.concatenate([self.curves.coefficients(self.internal(x)), corrected])

    def blocks(self, x: Array) -> tuple[Array, Array]:
        """Return the blocks of J: one a joint, shape (n, R, p), and one a body, shape (L, 10, 10).

        Behind them there is a number for each other correction.
        """
        return self.curves.jacobians(self.internal(x)), self.model.body_slopes(x[self.layout.model])

    def times_jacobian(self, matrix: Array, jacobian: tuple[Array, Array]) -> Array:
        """Return a matrix, shape (r, D), times J, which is block-diagonal, shape (r, m), by its `blocks`."""
        first, parts = 0, []
        for blocks in jacobian:
            last = first + blocks.shape[0] * blocks.shape[1]
            columns = matrix[:, first:last].reshape(len(matrix), *blocks.shape[:2])
            product = columns.transpose(1, 0, 2) @ blocks
            parts.append(product.transpose(1, 0, 2).reshape(len(matrix), blocks.shape[0] * blocks.shape[2]))
            first = last
        return np.hstack([*parts, matrix[:, first:] * self.model.scales])

    @cached_property
    def prior(self) -> tuple[Array, Array]:
        """Return mean, shape (m,), and inverse covariance, shape (m, m), of the prior of x."""
        mean, deviation = self.curves.prior
        precision = block_diag(np.diag(deviation.ravel() ** -2.0), self.model.precision)
        return np.concatenate([mean.ravel(), np.zeros(self.model.size)]), precision
