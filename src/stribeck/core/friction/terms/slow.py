"""Slow changes of friction: with temperature (Bittencourt and Gunnarsson 2012), or with time if none is logged."""

from collections.abc import Mapping
from functools import partial
from typing import Literal

import numpy as np

from stribeck.core.friction.terms.term import Seen, Term, linear


def _not_warmed(seen: Seen) -> str:
    if seen.temperature is None:
        return "no temperature in the log"
    if not np.isfinite(seen.temperature).all():
        return "the log has no temperature of this joint throughout"
    change = np.ptp(seen.temperature)
    return f"its temperature changes by {change:.2g} K; 2 K are needed" if change < 2.0 else ""


def _no_drift(seen: Seen) -> str:
    if seen.temperature is not None:
        return "the log has temperatures, which explain drift better than time"
    shortest = 20.0  # shortest log for terms of drift [s], chosen by judgment
    if seen.duration < shortest:
        return f"the log lasts {seen.duration:.3g} s; {shortest:.0f} s are needed"
    return "the speed changes steadily over the log, so that friction over time and over speed look the same" * (
        seen.chirps > 0.5
    )


def _negative(name: str, values: Mapping[str, float], _: frozenset[str]) -> str:
    negative = values[name] < abs(values.get(f"{name}_drift", 0.0)) / 2
    return f"{name} friction would be negative at the beginning of the log or at its end" if negative else ""


def _slow(kind: Literal["coulomb", "viscous"], over: Literal["temperature", "time"], parameter: str, unit: str) -> Term:
    """Make the term of a change of Coulomb or viscous friction."""
    warm, viscous = over == "temperature", kind == "viscous"
    symbol = f"F{kind[0]}_{'T' if warm else 't'}"
    return Term(
        name=f"{kind}_{'temperature' if warm else 'drift'}",
        parameters=(linear(parameter, symbol, unit),),
        columns=(f"{'temperature' if warm else 'elapsed'} * {'velocity' if viscous else 'rise'}",),
        needs="viscous" if viscous else "",
        over=over,
        refuse=_not_warmed if warm else _no_drift,
        doubt=partial(_negative, kind),
        misfit="drift",
        words="drift",
    )


SLOW = (
    _slow("coulomb", "temperature", "coulomb_per_kelvin", "N m/K"),
    _slow("viscous", "temperature", "viscous_per_kelvin", "N m s/(rad K)"),
    _slow("coulomb", "time", "coulomb_drift", "N m"),
    _slow("viscous", "time", "viscous_drift", "N m s/rad"),
)
