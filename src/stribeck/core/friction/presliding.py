"""Presliding: lag of friction behind the sign of the velocity (Dahl 1968)."""

import numpy as np

from stribeck.core.base.typing import Array

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
    return np.ascontiguousarray(_recursion(falls, keep).transpose(1, 0, 2))


def _recursion(added: Array, kept: Array) -> Array:
    """Solve y(t) = (y(t - 1) + added(t)) kept(t) with y = 0 before, along the first axis; kept is from 0 to 1.

    Blocks of about sqrt(T) samples are solved at once, each from zero. Then the effect of the previous block is added.
    """
    samples, length = len(kept), int(np.sqrt(len(kept))) + 1
    padding = ((0, -samples % length), (0, 0), (0, 0))
    added, kept = (np.pad(series, padding).reshape(-1, length, *series.shape[1:]) for series in (added, kept))
    solution, shares = np.empty(kept.shape), np.cumprod(kept, axis=1)
    solution[:, 0] = added[:, 0] * kept[:, 0]
    for k in range(1, length):
        solution[:, k] = (solution[:, k - 1] + added[:, k]) * kept[:, k]
    for before, block, share in zip(solution, solution[1:], shares[1:], strict=False):
        block += share * before[-1]
    return solution.reshape(-1, *kept.shape[2:])[:samples]
