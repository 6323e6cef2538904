"""How often a turn a joint's torque ripples: a periodogram over its position (Lomb 1976; Scargle 1982)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.signal import lombscargle

from stribeck.identification.whole_log.constants import FEWEST_PERIODS, FINER, MOST_FREQUENCIES, MOST_PER_TURN
from stribeck.typing import Array
from stribeck.weak_equations import WeakEquations


def ripples_per_turn(equations: Sequence[WeakEquations], residuals: Sequence[Array]) -> Array:
    """Return the periods a turn that explain most of each joint's residual torque, shape (n,).

    NaN of prismatic joints, couplings, and joints whose motion spans too little of a turn. Whether there is a ripple is
    for the selection of terms to say.

    Parameters
    ----------
    equations, residuals
        Segments, and the residual of a fit to each, shape (K m,).
    """
    torques, positions = [], []
    for part, residual in zip(equations, residuals, strict=True):
        torque = np.einsum("kmj,km->kj", part.weights, residual.reshape(part.residual.shape))
        torques.append(torque[part.used])
        positions.append(part.windows(part.position)[part.used])
    pairs = zip(np.concatenate(positions).T, np.concatenate(torques).T, strict=True)
    return np.array([_per_turn(position, torque) for position, torque in pairs])


def _per_turn(position: Array, torque: Array) -> float:
    """Return the frequency over positions, shape (K,), of most power: in radians a radian, or periods a turn."""
    span = float(np.ptp(position)) if len(position) else np.nan
    if not span > 0 or not torque.any():
        return np.nan
    lowest = 2 * np.pi * FEWEST_PERIODS / span
    if lowest > MOST_PER_TURN:
        return np.nan
    count = min(MOST_FREQUENCIES, 2 + round((MOST_PER_TURN - lowest) * span))
    frequencies = np.linspace(lowest, MOST_PER_TURN, count)
    best = frequencies[np.argmax(_power(position, torque, frequencies))]
    step = frequencies[1] - frequencies[0]
    closer = np.linspace(max(best - step, lowest), best + step, FINER)
    return float(closer[np.argmax(_power(position, torque, closer))])


def _power(position: Array, torque: Array, frequencies: Array) -> Array:
    """Return the share of the torque's variance that each frequency explains, shape (F,)."""
    return np.asarray(lombscargle(position, torque, frequencies, normalize=True, floating_mean=True))
