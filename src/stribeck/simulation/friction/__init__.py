"""Simulated joint friction: laws of the library, and additional effects."""

from stribeck.simulation.friction.backlash import Backlash as Backlash
from stribeck.simulation.friction.injection import FrictionEffect as FrictionEffect
from stribeck.simulation.friction.injection import FrictionTruth as FrictionTruth
from stribeck.simulation.friction.injection import Instant as Instant
from stribeck.simulation.friction.law import Drift as Drift
from stribeck.simulation.friction.law import LawFriction as LawFriction
from stribeck.simulation.friction.law import Load as Load
from stribeck.simulation.friction.lugre import LuGre as LuGre
