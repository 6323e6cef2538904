"""Presliding: how far friction lags behind the sign of the velocity (Dahl 1968)."""

import numpy as np

from stribeck.base.typing import Array

SMOOTH_SIGN = 0.01
"""Speed over the top speed at which the smooth sign has risen to 76 % [1], chosen by judgement."""


def lag_behind(velocity: Array, period: float, smooth: Array | float, travels: Array) -> Array:
    """Return z - s(v) along a motion, with dz/dt = (s - z) |v| / d and s = tanh(v / smooth), shape (c, T, n).

    The motion begins with z = s: friction has built up before.

    Parameters
    ----------
    velocity
        [rad/s], shape (T, n).
    period
        [s].
    smooth
        Speed at which the sign has risen to 76 % [rad/s], of all or shape (n,).
    travels
        d [rad], of c kinds, shape (c, n).
    """
    sign = np.tanh(velocity / smooth)
    keep = np.exp(-period * np.abs(velocity)[:, None] / travels)  # (T, c, n)
    falls = -np.diff(sign, axis=0, prepend=sign[:1])[:, None]  # z - s falls as s rises
    lags = np.zeros_like(keep)
    for k in range(1, len(sign)):  # z needs that of the sample before
        lags[k] = (lags[k - 1] + falls[k]) * keep[k]
    return np.ascontiguousarray(lags.transpose(1, 0, 2))
