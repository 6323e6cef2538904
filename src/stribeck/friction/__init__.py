"""Friction laws: the base class and one file per law."""

from stribeck.errors import SettingsError, did_you_mean
from stribeck.friction.asymmetric import Asymmetric as Asymmetric
from stribeck.friction.auto import AutoLaw as AutoLaw
from stribeck.friction.coulomb_viscous import CoulombViscous as CoulombViscous
from stribeck.friction.law import FrictionLaw as FrictionLaw
from stribeck.friction.law import LawWithState as LawWithState
from stribeck.friction.law import Parameter as Parameter
from stribeck.friction.law import unit_for as unit_for
from stribeck.friction.lugre import LuGre as LuGre
from stribeck.friction.stribeck import Stribeck as Stribeck
from stribeck.friction.stribeck_exponent import StribeckExponent as StribeckExponent

LAWS: dict[str, type[FrictionLaw]] = {law.name: law for law in (CoulombViscous, Stribeck, StribeckExponent, Asymmetric)}

LAWS_WITH_STATE: dict[str, type[FrictionLaw]] = {LuGre.name: LuGre}
"""Laws with internal state, fitted along a motion."""

AUTO = AutoLaw.name
"""Name that stands for the terms supported by each joint's log."""


def get_law(name: str) -> FrictionLaw:
    """Return the friction law of a name. For "auto", it is the law with all selectable terms.

    Raises
    ------
    SettingsError
        If the law does not exist; the message lists the existing ones.
    """
    if name == AUTO:
        return AutoLaw()
    laws = {**LAWS, **LAWS_WITH_STATE}
    if name not in laws:
        names = sorted([*laws, AUTO])
        raise SettingsError(f"law: found '{name}', expected one of {', '.join(names)}{did_you_mean(name, names)}")
    return laws[name]()
