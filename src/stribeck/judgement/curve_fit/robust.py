"""Robust losses: the scale of the residuals and the weight that a loss gives them."""

from typing import Literal

import numpy as np

from stribeck.base.typing import Array

Loss = Literal["linear", "soft_l1", "huber", "cauchy"]

TUNING: dict[Loss, float] = {"linear": 1.0, "soft_l1": 1.345, "huber": 1.345, "cauchy": 2.385}
"""Loss scales, in standard deviations of the residual [1]: 95 % efficiency on normal noise (Huber, Cauchy)."""


def robust_scale(residual: Array) -> float:
    """Return the standard deviation [N m] of the residuals by their median absolute value, never zero."""
    scale = 1.4826 * float(np.median(np.abs(residual)))  # of a normal distribution
    return max(scale, 1e-150)  # its square is still a number


def influence(ratio: Array, loss: Loss) -> tuple[Array, float]:
    """Return the influence psi of residuals and its mean slope [1].

    `ratio` is the residual over the loss's scale, shape (N,). SciPy minimises sum rho(z) / 2 with z = ratio^2, so
    psi = ratio rho'(z); the mean slope is E[d psi / d ratio].
    """
    z = ratio**2
    if loss == "linear":
        return ratio, 1.0
    if loss == "huber":
        inside = z <= 1
        return np.clip(ratio, -1.0, 1.0), float(np.mean(inside))
    if loss == "soft_l1":
        return ratio / np.sqrt(1 + z), float(np.mean((1 + z) ** -1.5))
    return ratio / (1 + z), float(np.mean((1 - z) / (1 + z) ** 2))
