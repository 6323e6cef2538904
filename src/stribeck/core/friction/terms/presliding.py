"""Coulomb friction that builds up over a travel after a reversal (`friction/presliding.py`, Dahl 1968)."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.friction.terms.term import Seen, Term, linear


def _find(pilot: Any) -> list[Array]:
    """Find the travel that explains most of each joint's residual torque in addition to its curve [rad].

    NaN if the best travel is the longest or the shortest in the search, because the residual then has no such travel.
    The shortest is the encoder's step, because coarse encoders detect reversals late.
    """
    travels = np.geomspace(0.125e-3, 32e-3, 9)  # candidates divided by the top speed [s]
    coarse = _best_travels(pilot, travels[:, None] * pilot.terms.top_speed)
    near = np.where(np.isfinite(coarse), coarse, pilot.terms.top_speed) * np.geomspace(0.75, 1.33, 5)[:, None]
    closer = _best_travels(pilot, near)
    return [np.where(np.isfinite(closer), closer, coarse) + 0 * coarse]


def _best_travels(pilot: Any, travels: Array) -> Array:
    """Find the best of c travels, shape (c, n), with interpolation."""
    resolved = travels >= pilot.resolution
    falls = np.where(resolved.T, pilot.falls("lag(travel)", [{"travel": travel} for travel in travels]), 0.0)
    places = np.arange(len(travels))
    joints = zip(falls, resolved.T, np.log(travels).T, strict=True)
    return np.exp(np.array([np.interp(_best(*joint[:2]), places, joint[2]) for joint in joints], dtype=np.float64))


def _best(falls: Array, resolved: Array) -> float:
    """Find the place in the grid with the lowest chi^2, by a parabola through three points; NaN at an end."""
    best = int(np.argmax(falls))
    if not 0 < best < len(falls) - 1 or not resolved[best - 1]:
        return np.nan
    before, middle, after = falls[best - 1 : best + 2]
    return best + 0.5 * float((before - after) / (before - 2 * middle + after))


def _refuse(seen: Seen) -> str:
    none = "no travel explains more of its torque than shorter and longer ones do"
    return none if np.isnan(seen.settings[0]) else ""


def _doubt(_: Mapping[str, float], kept: frozenset[str]) -> str:
    both = {"stribeck", "presliding"} <= kept
    return "after a reversal, the Stribeck effect and presliding compensate for each other" if both else ""


PRESLIDING = Term(
    name="presliding",
    parameters=(linear("presliding", "Fc_z", "N m", lower=0.0),),
    over="travel",
    columns=("lag(presliding_travel)",),
    settings=("presliding_travel",),
    find=_find,
    refuse=_refuse,
    doubt=_doubt,
    misfit="presliding",
    words="presliding",
)
