"""Errors that no sensor makes: of the model, and of the root that is taken to stand still."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stribeck.equations import WeakEquations
from stribeck.log import Array

FIRST_MODEL, FIRST_LINEAR, FIRST_ANGULAR = 0.02, 0.01, 0.01
"""Levels before the log has been heard [N m], [m/s^2], [rad/s^2]: of a good model and a hard floor."""


@dataclass(frozen=True, eq=False)
class ErrorLevels:
    """Standard deviations, each error correlated over a window's length.

    Attributes
    ----------
    model
        Of each joint's inverse dynamics [N m], shape (n,).
    root
        Of the root's linear [m/s^2] and angular acceleration [rad/s^2], shape (6,); (0,) for a fixed base.
    """

    model: Array
    root: Array

    def response(self, equations: WeakEquations) -> Array:
        """Return what errors of unit level do to the equations, shape (K, m, n + root)."""
        return np.concatenate([equations.weights, equations.root_response], axis=2)

    @property
    def values(self) -> Array:
        """Levels in the order of `response`, shape (n + root,)."""
        return np.concatenate([self.model, self.root])


def first_levels(equations: WeakEquations) -> ErrorLevels:
    """Return the levels to begin with."""
    joints, root = equations.velocity.shape[1], equations.root_response.shape[2]
    both = np.repeat([FIRST_LINEAR, FIRST_ANGULAR], 3)[:root]
    return ErrorLevels(np.full(joints, FIRST_MODEL), both)


def bartlett(lags: int) -> Array:
    """Return the correlation of these errors at lags 0 to `lags` [1]: that of a running mean over lags + 1."""
    return np.asarray(1 - np.arange(lags + 1) / (lags + 1))
