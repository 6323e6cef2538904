"""Torque that is periodic in the position at any velocity: from a gear, a motor or a torque sensor.

Periodogram over position: Lomb 1976; Scargle 1982.
"""

from typing import Any

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.friction.terms.term import Seen, Term, linear


def _find(pilot: Any) -> list[Array]:
    """Find the periods per turn that explain most of each joint's residual torque.

    NaN for prismatic joints, couplings, and joints whose motion spans too little of a turn. The selection of terms
    decides whether a ripple exists.
    """
    joints = zip(pilot.position.T, pilot.score.T, pilot.information.T, pilot.speed.tolist(), strict=True)
    return [np.array([_per_turn(*joint) for joint in joints])]


def _refuse(seen: Seen) -> str:
    return "its motion spans too little of a turn, or is none" if np.isnan(seen.settings[0]) else ""


def _per_turn(position: Array, score: Array, known: Array, speed: float) -> float:
    """Find the frequency over positions, shape (K,), with the most power: in radians per radian, or periods per turn.

    At least two periods are required, because one would be a spring or gravity. Limits are 25 periods per second,
    because the window averages faster ones, and 300 per turn. A whole number is taken if it has nearly the most power.
    """
    mask = (known > 0) & np.isfinite(position)
    span = float(np.ptp(position[mask])) if mask.any() else 0.0
    lowest, highest = 2 * np.pi * np.array([2 / max(span, 1e-9), 25 / max(speed, 1e-9)])
    highest = min(highest, 300.0)
    if lowest >= highest or not score[mask].any():
        return np.nan
    known, place = known[mask], position[mask]
    weights = known / known.sum()
    torque = score[mask] / known
    torque -= weights @ torque

    def power(frequencies: Array) -> Array:
        """Compute the share of the squared torque that a sine of each frequency explains in addition to a constant."""
        angle = frequencies[:, None] * place
        waves = np.stack([np.cos(angle), np.sin(angle)])
        waves -= (waves @ weights)[:, :, None]
        c, s = (waves * weights) @ torque
        inner = np.einsum("afk,bfk,k->abf", waves, waves, weights, optimize=True)
        determinant = np.maximum(inner[0, 0] * inner[1, 1] - inner[0, 1] ** 2, 1e-12)
        return np.asarray((c**2 * inner[1, 1] - 2 * c * s * inner[0, 1] + s**2 * inner[0, 0]) / determinant)

    # approximate frequency: the spectrum of the torque over a grid of positions
    width, apart = np.pi / (4 * highest), 1 / (2 * span)
    size = 2 ** int(np.ceil(np.log2(2 * np.pi / (width * apart))))
    cells = ((place - place.min()) / width).astype(int)
    spectrum = np.abs(np.fft.rfft(np.bincount(cells, weights * torque, size)))
    frequencies = 2 * np.pi / (size * width) * np.arange(len(spectrum))
    spectrum[(frequencies < lowest) | (frequencies > highest)] = 0.0
    coarse = frequencies[np.argsort(spectrum)[-40:]]
    best = coarse[np.argmax(power(coarse))]
    closer = np.linspace(max(best - apart, lowest), best + apart, 21)
    best = closer[np.argmax(power(closer))]
    whole = max(round(best), 1)
    of_both = power(np.array([best, whole], dtype=np.float64))
    return float(whole if whole >= lowest and of_both[1] > 0.95 * of_both[0] else best)


RIPPLE = Term(
    name="ripple",
    parameters=(linear("ripple_cosine", "tau_c", "N m"), linear("ripple_sine", "tau_s", "N m")),
    over="position",
    columns=("cos(ripple_per_turn * position)", "sin(ripple_per_turn * position)"),
    settings=("ripple_per_turn",),
    find=_find,
    refuse=_refuse,
    misfit="ripple",
    words="ripple over position",
    shown=", {:.3g} periods per turn",
)
