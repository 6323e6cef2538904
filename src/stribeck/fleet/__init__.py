"""Fleets: all logs of many robots in one store, and the friction of a robot type over time."""

from stribeck.fleet.run import run_fleet as run_fleet
from stribeck.fleet.store import compact as compact
from stribeck.fleet.store import connect as connect
from stribeck.fleet.trends import find_trends as find_trends
