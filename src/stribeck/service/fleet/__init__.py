"""Fleets: all logs of many robots in one store, and the friction of a robot type over time."""

from stribeck.service.fleet.run import run_fleet as run_fleet
from stribeck.service.fleet.store import compact as compact
from stribeck.service.fleet.store import connect as connect
from stribeck.service.fleet.trends import find_trends as find_trends
