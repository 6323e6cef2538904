"""Presliding: lag of friction behind the sign of the velocity (Dahl 1968)."""

import numpy as np

from stribeck.base.typing import Array

SMOOTH_SIGN = 0.01
"""Speed relative to the top speed at which the smooth sign reaches 76 % [1], chosen by judgment."""


def lag_behind(velocity: Array, period: float, smooth: Array | float, travels: Array) -> Array:
    """Compute z - s(v) along a motion, with dz/dt = (s - z) |v| / d and s = tanh(v / smooth), shape (c, T, n).

    The motion starts with z = s: friction has built up before.

    Parameters
    ----------
    velocity
        Velocity [rad/s], shape (T, n).
    period
        Sampling period [s].
    smooth
        Speed at which the sign reaches 76 % [rad/s], one value or shape (n,).
    travels
        Travel d [rad], c values per joint, shape (c, n).
    """
    sign = np.tanh(velocity / smooth)
    keep = np.exp(-period * np.abs(velocity)[:, None] / travels)  # (T, c, n)
    falls = -np.diff(sign, axis=0, prepend=sign[:1])[:, None]  # z - s falls as s rises
    lags = np.zeros_like(keep)
    for k in range(1, len(sign)):  # z depends on the previous z
        lags[k] = (lags[k - 1] + falls[k]) * keep[k]
    return np.ascontiguousarray(lags.transpose(1, 0, 2))
