"""Friction of a robot in service: estimates and alarms from a stream of samples (docs/watch.md)."""

from stribeck.service.online.alarms import Alarm as Alarm
from stribeck.service.online.estimator import OnlineFriction as OnlineFriction
from stribeck.service.online.friction_state import FrictionState as FrictionState
