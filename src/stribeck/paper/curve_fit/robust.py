"""Robust losses: scale of the residuals, and influence of each residual."""

from typing import Literal

import numpy as np

from stribeck.core.base.typing import Array

Loss = Literal["linear", "soft_l1", "huber", "cauchy"]

TUNING: dict[Loss, float] = {"linear": 1.0, "soft_l1": 1.345, "huber": 1.345, "cauchy": 2.385}
"""Loss scales in standard deviations of the residual [1], for 95 % efficiency with normal noise (Huber, Cauchy)."""


def influence(ratio: Array, loss: Loss) -> tuple[Array, float]:
    """Compute the influence psi of residuals and its mean slope [1].

    `ratio` is the residual divided by the loss scale, shape (N,). SciPy minimizes sum rho(z) / 2 with z = ratio^2, so
    psi = ratio rho'(z). The mean slope is E[d psi / d ratio].
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
