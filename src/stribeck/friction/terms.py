"""Terms of a joint's friction, from the simplest up."""

from dataclasses import dataclass

from stribeck.friction.law import Parameter


@dataclass(frozen=True)
class Term:
    """Term and its parameters.

    `needs` is another term that must be present, `part_of` a term that includes its parameters.
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
"""Terms in addition to Coulomb friction and offset, from the simplest up. Every joint has Coulomb friction and offset.

The size of a Stribeck effect and the slope of friction at standstill compensate for each other. The Stribeck term
therefore includes the slope.
"""

BASE = frozenset({"viscous"})
"""Terms that are present unless the log contradicts them."""

LOAD = Parameter(name="load", symbol="mu", unit="1", neutral=0.0)
"""Coulomb friction per newton meter of load torque."""

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
"""Slow changes of friction: per kelvin relative to the mean temperature, or from the start of a log to its end."""

POSITION = (
    Parameter(name="coulomb_cosine", symbol="Fc_c", unit="N m", lower=float("-inf"), neutral=0.0),
    Parameter(name="coulomb_sine", symbol="Fc_s", unit="N m", lower=float("-inf"), neutral=0.0),
)
"""Coulomb friction versus cosine and sine of a joint's position minus their means."""

RIPPLE = (
    Parameter(name="ripple_cosine", symbol="tau_c", unit="N m", lower=float("-inf"), neutral=0.0),
    Parameter(name="ripple_sine", symbol="tau_s", unit="N m", lower=float("-inf"), neutral=0.0),
)
"""Torque that is periodic in the position, independent of velocity: from a gear, a motor or a torque sensor."""

PRESLIDING = Parameter(name="presliding", symbol="Fc_z", unit="N m", neutral=0.0)
"""Coulomb friction that builds up over a travel after a reversal."""

BEYOND_VELOCITY = (LOAD, *SLOW["temperature"], *SLOW["drift"], *POSITION, *RIPPLE, PRESLIDING)
"""Parameters of terms that depend on more than velocity."""
