"""The terms that a joint's friction may have, from the simplest up."""

from dataclasses import dataclass

from stribeck.friction.law import Parameter


@dataclass(frozen=True)
class Term:
    """A term and its parameters.

    `needs` is another term without which it means nothing, `part_of` one that has its parameters too.
    """

    name: str
    parameters: tuple[str, ...]
    needs: str = ""
    part_of: str = ""


LADDER = (
    Term("viscous", ("viscous",)),
    Term("rounding", ("slope",), part_of="stribeck"),
    Term("stribeck", ("stribeck_gain", "stribeck_velocity", "slope")),
    Term("asymmetry", ("viscous_asymmetry",), needs="viscous"),
    Term("load", ("load",)),
    Term("coulomb_position", ("coulomb_cosine", "coulomb_sine")),
    Term("ripple", ("ripple_cosine", "ripple_sine")),
    Term("presliding", ("presliding",)),
    Term("viscous_temperature", ("viscous_per_kelvin",), needs="viscous"),
    Term("coulomb_temperature", ("coulomb_per_kelvin",)),
    Term("viscous_drift", ("viscous_drift",), needs="viscous"),
    Term("coulomb_drift", ("coulomb_drift",)),
)
"""Beyond Coulomb friction and an offset, which every joint has, from the simplest up.

How large a Stribeck effect is and how fast friction rises at standstill make up for each other, so that the first is
never found by taking the second for a jump.
"""

BASE = frozenset({"viscous"})
"""Terms that a joint has unless the log speaks against them."""

LOAD = Parameter(name="load", symbol="mu", unit="1", neutral=0.0)
"""Coulomb friction a newton metre of torque that the joint carries."""

SLOW = {
    "temperature": (
        Parameter(name="coulomb_per_kelvin", symbol="Fc_T", unit="N m/K", lower=float("-inf"), neutral=0.0),
        Parameter(name="viscous_per_kelvin", symbol="Fv_T", unit="N m s/(rad K)", lower=float("-inf"), neutral=0.0),
    ),
    "drift": (
        Parameter(name="coulomb_drift", symbol="Fc_t", unit="N m", lower=float("-inf"), neutral=0.0),
        Parameter(name="viscous_drift", symbol="Fv_t", unit="N m s/rad", lower=float("-inf"), neutral=0.0),
    ),
}
"""How friction changes slowly: a kelvin away from its mean temperature, or from the beginning of a log to its end."""

POSITION = (
    Parameter(name="coulomb_cosine", symbol="Fc_c", unit="N m", lower=float("-inf"), neutral=0.0),
    Parameter(name="coulomb_sine", symbol="Fc_s", unit="N m", lower=float("-inf"), neutral=0.0),
)
"""Coulomb friction over cosine and sine of a joint's position, less their means."""

RIPPLE = (
    Parameter(name="ripple_cosine", symbol="tau_c", unit="N m", lower=float("-inf"), neutral=0.0),
    Parameter(name="ripple_sine", symbol="tau_s", unit="N m", lower=float("-inf"), neutral=0.0),
)
"""Torque that comes and goes so many times a turn, whatever the velocity: of a gear, a motor or a torque sensor."""

PRESLIDING = Parameter(name="presliding", symbol="Fc_z", unit="N m", neutral=0.0)
"""Coulomb friction that builds up over a travel after a reversal."""

BEYOND_VELOCITY = (LOAD, *SLOW["temperature"], *SLOW["drift"], *POSITION, *RIPPLE, PRESLIDING)
"""Parameters that are no function of velocity alone."""
