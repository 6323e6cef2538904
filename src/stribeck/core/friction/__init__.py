"""Friction laws: the base class and one file per law."""

from stribeck.core.friction.auto import AutoLaw as AutoLaw
from stribeck.core.friction.catalogue import AUTO as AUTO
from stribeck.core.friction.catalogue import LAWS as LAWS
from stribeck.core.friction.catalogue import LAWS_WITH_STATE as LAWS_WITH_STATE
from stribeck.core.friction.catalogue import get_law as get_law
from stribeck.core.friction.coulomb_viscous import CoulombViscous as CoulombViscous
from stribeck.core.friction.law import FrictionLaw as FrictionLaw
from stribeck.core.friction.law import LawWithState as LawWithState
from stribeck.core.friction.law import Parameter as Parameter
from stribeck.core.friction.law import unit_for as unit_for
from stribeck.core.friction.stribeck import Stribeck as Stribeck
