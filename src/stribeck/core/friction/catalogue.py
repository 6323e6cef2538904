"""Friction laws by name."""

from stribeck.core.base.parts import Parts
from stribeck.core.errors import SettingsError, did_you_mean
from stribeck.core.friction.auto import AutoLaw
from stribeck.core.friction.law import FrictionLaw

LAWS = Parts[type[FrictionLaw]]("stribeck.laws")

LAWS_WITH_STATE = Parts[type[FrictionLaw]]("stribeck.laws_with_state")
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
    laws = LAWS if name in LAWS else LAWS_WITH_STATE
    if name not in laws:
        names = sorted([*LAWS, *LAWS_WITH_STATE, AUTO])
        raise SettingsError(f"law: found '{name}', expected one of {', '.join(names)}{did_you_mean(name, names)}")
    return laws[name]()
