"""Friction of a robot in service: estimates and alarms from a stream of samples (docs/watch.md)."""

from stribeck.online.alarms import Alarm as Alarm
from stribeck.online.estimator import OnlineFriction as OnlineFriction
from stribeck.online.friction_state import FrictionState as FrictionState
