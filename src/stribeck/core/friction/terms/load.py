"""Coulomb friction that grows with the torque that a joint carries (Hamon, Gautier and Garrec 2010)."""

from collections.abc import Mapping

from stribeck.core.friction.terms.term import Seen, Term, linear


def _refuse(seen: Seen) -> str:
    changes = seen.load_deviation > 0.1 * seen.mean_load
    return "" if changes else f"its load hardly changes: {seen.mean_load:.3g} N m +- {seen.load_deviation:.2g}"


def _doubt(values: Mapping[str, float], kept: frozenset[str]) -> str:
    """Refuse friction that vanishes without load: gears and seals also resist without load."""
    return "Coulomb friction would be zero without load" if "load" in kept and values["coulomb"] <= 0 else ""


LOAD = Term(
    name="load",
    parameters=(linear("load", "mu", "1", lower=0.0),),
    columns=("abs(load) * rise",),
    over="load",
    refuse=_refuse,
    doubt=_doubt,
    misfit="load",
    words="load",
)
