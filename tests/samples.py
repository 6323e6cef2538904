"""Synthetic friction torque samples."""

from typing import Any

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.result.samples import FrictionSamples


def make_samples(
    velocity: Array, friction_torque: Array, names: tuple[str, ...] = ("knee",), period: float = 1e-3, **changed: Any
) -> FrictionSamples:
    """Make consecutive samples of shape (N,) or (N, n), all usable, one per block; fields may be overridden."""
    count, shape = len(velocity), (len(velocity), len(names))
    fields = {
        "time": period * np.arange(count),
        "velocity": velocity.reshape(shape),
        "acceleration": np.zeros(shape),
        "friction_torque": friction_torque.reshape(shape),
        "usable": np.ones(shape, dtype=bool),
        "block": np.arange(count),
        "support": np.zeros(count, dtype=np.int64),
        "support_names": ("base",),
    }
    return FrictionSamples(joint_names=names, period=period, **(fields | changed))
