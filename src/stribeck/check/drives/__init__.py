"""Torques that follow from currents and commands: torque constants, gains and delays of the drives."""

from stribeck.check.drives.torques import find_torques as find_torques
from stribeck.check.drives.torques import inseparable_delays as inseparable_delays
