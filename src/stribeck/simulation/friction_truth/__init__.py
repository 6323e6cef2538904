"""The friction that a simulator puts into the joints: the library's laws, and some that the estimator does not have."""

from stribeck.simulation.friction_truth.backlash import Backlash as Backlash
from stribeck.simulation.friction_truth.drift import Drift as Drift
from stribeck.simulation.friction_truth.injection import FrictionEffect as FrictionEffect
from stribeck.simulation.friction_truth.injection import FrictionTruth as FrictionTruth
from stribeck.simulation.friction_truth.injection import Instant as Instant
from stribeck.simulation.friction_truth.law import LawFriction as LawFriction
from stribeck.simulation.friction_truth.load import Load as Load
from stribeck.simulation.friction_truth.lugre import LuGre as LuGre
