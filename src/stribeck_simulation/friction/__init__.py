"""Simulated joint friction: laws of the library, and additional effects."""

from stribeck_simulation.friction.backlash import Backlash as Backlash
from stribeck_simulation.friction.injection import FrictionEffect as FrictionEffect
from stribeck_simulation.friction.injection import FrictionTruth as FrictionTruth
from stribeck_simulation.friction.injection import Instant as Instant
from stribeck_simulation.friction.law import Drift as Drift
from stribeck_simulation.friction.law import LawFriction as LawFriction
from stribeck_simulation.friction.law import Load as Load
from stribeck_simulation.friction.lugre import LuGre as LuGre
