"""How fast a joint moves, and when it is at rest."""

import numpy as np

from stribeck.base.typing import Array

TOP_SPEED_PERCENTILE = 99.0
"""Percentile of |v| [%] that counts as a joint's top speed: the very fastest samples may be outliers."""


def top_speed(velocity: Array) -> float:
    """Return the speed that a joint reaches but for outliers [rad/s], 0 without samples."""
    return float(np.percentile(np.abs(velocity), TOP_SPEED_PERCENTILE)) if len(velocity) else 0.0
