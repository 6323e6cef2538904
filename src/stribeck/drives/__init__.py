"""Torques that follow from currents and commands: torque constants, gains and delays of the drives."""

from stribeck.drives.command_delay import inseparable_delays as inseparable_delays
from stribeck.drives.gains import find_torques as find_torques
