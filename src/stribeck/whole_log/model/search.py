"""Find ripple periods per turn and the presliding travel in a joint's residual torque, before the whole log is read.

Periodogram over position: Lomb 1976; Scargle 1982. Presliding: Dahl 1968.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.whole_log.model.basis import Basis
from stribeck.whole_log.weak_equations import WeakEquations

TRAVELS = np.geomspace(0.125e-3, 32e-3, 9)
"""Candidate travels of presliding, divided by the top speed [s]."""

Left = Sequence[tuple[WeakEquations, Array, Array]]
"""Equations, residuals of a fit, and their expected variances, shape (K, m) each."""


def by_joint(left: Left) -> tuple[Array, Array]:
    """Compute each joint's residual torque times its information, and the information, shape (all K, n) each."""
    found = []
    for part, residual, variance in left:
        shares = part.weights / variance[:, :, None] * part.used[:, None, None]
        found.append((np.einsum("kmj,km->kj", shares, residual), np.einsum("kmj,kmj->kj", shares, part.weights)))
    scores, known = zip(*found, strict=True)
    return np.concatenate(scores), np.concatenate(known)


def ripples_per_turn(left: Left) -> Array:
    """Find the periods per turn that explain most of each joint's residual torque, shape (n,).

    NaN for prismatic joints, couplings, and joints whose motion spans too little of a turn. The selection of terms
    decides whether a ripple exists.
    """
    scores, known = by_joint(left)
    positions = np.concatenate([part.windows(part.position) for part, _, _ in left])
    speeds = np.sqrt(np.mean(np.concatenate([part.velocity for part, _, _ in left]) ** 2, axis=0))
    joints = zip(positions.T, scores.T, known.T, speeds.tolist(), strict=True)
    return np.array([_per_turn(*each) for each in joints])


def _per_turn(position: Array, score: Array, known: Array, speed: float) -> float:
    """Find the frequency over positions, shape (K,), with the most power: in radians per radian, or periods per turn.

    At least two periods are required, because one would be a spring or gravity. Limits are 25 periods per second,
    because the window averages faster ones, and 300 per turn. A whole number is taken if it has nearly the most power.
    """
    there = (known > 0) & np.isfinite(position)
    span = float(np.ptp(position[there])) if there.any() else 0.0
    lowest, highest = 2 * np.pi * np.array([2 / max(span, 1e-9), 25 / max(speed, 1e-9)])
    highest = min(highest, 300.0)
    if lowest >= highest or not score[there].any():
        return np.nan
    known, place = known[there], position[there]
    weights = known / known.sum()
    torque = score[there] / known
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


def presliding_travels(left: Left, basis: Basis, top_speed: Array) -> Array:
    """Find the travel that explains most of each joint's residual torque in addition to its curve [rad], shape (n,).

    NaN if the best travel is the longest or the shortest in the search, because the residual then has no such travel.
    The shortest is the encoder's step, because coarse encoders detect reversals late.
    """
    coarse = _travels(left, basis, top_speed, TRAVELS[:, None] * top_speed)
    near = np.where(np.isfinite(coarse), coarse, top_speed) * np.geomspace(0.75, 1.33, 5)[:, None]
    closer = _travels(left, basis, top_speed, near)
    return np.where(np.isfinite(closer), closer, coarse) + 0 * coarse


def _travels(left: Left, basis: Basis, top_speed: Array, travels: Array) -> Array:
    """Find the best of c travels, shape (c, n), with interpolation."""
    information, right = 0.0, 0.0
    for part, residual, variance in left:
        score, known = by_joint([(part, residual, variance)])
        windows = basis.windows(part.velocity, part.taps, part.step, len(part.residual))
        columns = np.concatenate([windows, part.presliding(top_speed, travels).transpose(1, 2, 0)], axis=2)
        information = information + np.einsum("kj,kjr,kjs->jrs", known, columns, columns, optimize=True)
        right = right + np.einsum("kj,kjr->jr", score, columns)
    steps = [np.sqrt(12) * part.position_noise for part, _, _ in left if part.position_noise is not None]
    resolved = travels >= np.max([np.zeros_like(top_speed), *steps], axis=0)
    each = zip(np.asarray(information), np.asarray(right), resolved.T, np.log(travels).T, strict=True)
    found = [np.interp(_best(*own[:3]), np.arange(len(travels)), own[3]) for own in each]
    return np.exp(np.array(found, dtype=np.float64))


def _best(information: Array, right: Array, resolved: NDArray[np.bool_]) -> float:
    """Find the place in the grid with the lowest chi^2, by a parabola through three points; NaN at an end."""
    r = len(right) - len(resolved)
    ridge = 1e-9 * np.trace(information[:r, :r]) * np.eye(r)
    beside = np.linalg.solve(information[:r, :r] + ridge, np.column_stack([information[:r, r:], right[:r]]))
    left = np.diag(information[r:, r:] - information[r:, :r] @ beside[:, :-1])
    score = right[r:] - information[r:, :r] @ beside[:, -1]
    falls = np.where(resolved & (left > 1e-6), np.maximum(score, 0.0) ** 2 / np.maximum(left, 1e-6), 0.0)
    best = int(np.argmax(falls))
    if not 0 < best < len(falls) - 1 or not resolved[best - 1]:
        return np.nan
    before, here, after = falls[best - 1 : best + 2]
    return best + 0.5 * float((before - after) / (before - 2 * here + after))
