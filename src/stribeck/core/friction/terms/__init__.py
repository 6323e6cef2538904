"""Terms of a joint's friction with the law `auto`: one object per term."""

from collections.abc import Mapping

from stribeck.core.friction.auto import AutoLaw
from stribeck.core.friction.law import Parameter
from stribeck.core.friction.terms.load import LOAD
from stribeck.core.friction.terms.position import COULOMB_POSITION
from stribeck.core.friction.terms.presliding import PRESLIDING
from stribeck.core.friction.terms.ripple import RIPPLE
from stribeck.core.friction.terms.slow import SLOW
from stribeck.core.friction.terms.term import Term


def _of_law(*names: str) -> tuple[Parameter, ...]:
    return tuple(parameter for parameter in AutoLaw.parameters if parameter.name in names)


def _uneven(values: Mapping[str, float], kept: frozenset[str]) -> str:
    """Refuse more than a threefold difference between the directions."""
    share = abs(values["viscous_asymmetry"])
    return f"viscous friction of one direction would be {share:.0%} more" if "asymmetry" in kept and share > 0.5 else ""


LADDER: tuple[Term, ...] = (
    Term(name="viscous", parameters=_of_law("viscous")),
    Term(name="rounding", parameters=_of_law("slope"), part_of="stribeck"),
    Term(name="stribeck", parameters=_of_law("stribeck_gain", "stribeck_velocity", "slope")),
    Term(name="asymmetry", parameters=_of_law("viscous_asymmetry"), needs="viscous", doubt=_uneven),
    *(LOAD, *SLOW, COULOMB_POSITION, RIPPLE, PRESLIDING),
)
"""Terms in addition to Coulomb friction and offset, which every joint has.

The size of a Stribeck effect and the slope of friction at standstill compensate for each other. The Stribeck term
therefore includes the slope.
"""

BASE = frozenset({"viscous"})
"""Terms that are present unless the log contradicts them."""

BEYOND_VELOCITY = tuple(parameter for term in LADDER if term.over for parameter in term.parameters)
"""Parameters of terms that depend on more than velocity."""


def parameters_over(*causes: str) -> tuple[str, ...]:
    """List the parameters of friction that depends on some causes (`Term.over`)."""
    return tuple(name for term in LADDER if term.over in causes for name in term.names)
