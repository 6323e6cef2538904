"""Top speed of a joint, and the limit of rest."""

import numpy as np

from stribeck.core.base.typing import Array

TOP_SPEED_PERCENTILE = 99.0
"""Percentile of |v| that defines a joint's top speed [%]; excludes outliers."""


def top_speed(velocity: Array) -> float:
    """Compute the top speed of a joint without outliers [rad/s]; 0 without samples."""
    return float(np.percentile(np.abs(velocity), TOP_SPEED_PERCENTILE)) if len(velocity) else 0.0


def robust_scale(residual: Array) -> float:
    """Estimate the standard deviation [N m] of the residuals from their median absolute value; always positive."""
    scale = 1.4826 * float(np.median(np.abs(residual)))  # factor for a normal distribution
    return max(scale, 1e-150)  # the square must not underflow
