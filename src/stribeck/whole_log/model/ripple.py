"""How often a turn a joint's torque ripples: a periodogram over its position (Lomb 1976; Scargle 1982)."""

from collections.abc import Sequence

import numpy as np
from scipy.signal import lombscargle

from stribeck.base.typing import Array
from stribeck.whole_log.constants import (
    FASTEST_RIPPLE,
    FEWEST_PERIODS,
    FINER,
    MOST_FREQUENCIES,
    MOST_PER_TURN,
    NEARLY,
)
from stribeck.whole_log.weak_equations import WeakEquations


def ripples_per_turn(
    equations: Sequence[WeakEquations], residuals: Sequence[Array], variances: Sequence[Array]
) -> Array:
    """Return the periods a turn that explain most of each joint's residual torque, shape (n,).

    NaN of prismatic joints, couplings, and joints whose motion spans too little of a turn. Whether there is a ripple is
    for others to say.

    Parameters
    ----------
    equations
        Segments.
    residuals, variances
        Of a fit to each, and those that it expects, shape (K, m).
    """
    scores, known = by_joint(equations, residuals, variances)
    positions = np.concatenate([part.windows(part.position) for part in equations])
    speeds = np.sqrt(np.mean(np.concatenate([part.velocity for part in equations]) ** 2, axis=0))
    joints = zip(positions.T, scores.T, known.T, speeds.tolist(), strict=True)
    return np.array([_per_turn(*each) for each in joints])


def by_joint(
    equations: Sequence[WeakEquations], residuals: Sequence[Array], variances: Sequence[Array]
) -> tuple[Array, Array]:
    """Return what residuals say of each joint by itself, times information, and that, shape (all K, n) each."""
    found = []
    for part, residual, variance in zip(equations, residuals, variances, strict=True):
        shares = part.weights / variance[:, :, None] * part.used[:, None, None]
        found.append((np.einsum("kmj,km->kj", shares, residual), np.einsum("kmj,kmj->kj", shares, part.weights)))
    scores, known = zip(*found, strict=True)
    return np.concatenate(scores), np.concatenate(known)


def _per_turn(position: Array, score: Array, known: Array, speed: float) -> float:
    """Return the frequency over positions, shape (K,), of most power: in radians a radian, or periods a turn."""
    there = (known > 0) & np.isfinite(position)
    span = float(np.ptp(position[there])) if there.any() else 0.0
    lowest, highest = 2 * np.pi * np.array([FEWEST_PERIODS / max(span, 1e-9), FASTEST_RIPPLE / max(speed, 1e-9)])
    highest = min(highest, MOST_PER_TURN)
    if lowest >= highest or not score[there].any():
        return np.nan
    known, place = known[there], position[there]
    torque = score[there] / known

    def power(frequencies: Array) -> Array:
        """Return the share of the torque's variance that each explains."""
        weights = known / known.sum()
        found = lombscargle(place, torque, frequencies, weights=weights, normalize=True, floating_mean=True)
        return np.asarray(found)

    coarse = np.linspace(lowest, highest, min(MOST_FREQUENCIES, 2 + round((highest - lowest) * span)))
    best, step = coarse[np.argmax(power(coarse))], coarse[1] - coarse[0]
    closer = np.linspace(max(best - step, lowest), best + step, FINER)
    best = closer[np.argmax(power(closer))]
    whole = max(round(best), 1)
    of_both = power(np.array([best, whole], dtype=np.float64))
    return float(whole if whole >= lowest and of_both[1] > NEARLY * of_both[0] else best)
