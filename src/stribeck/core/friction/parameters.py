"""Parameters that several laws share."""

import numpy as np

from stribeck.core.friction.law import Parameter

MAX_GAIN = 10.0
"""Largest Stribeck gain S [1]: breakaway at eleven times Coulomb friction. At larger gains, Coulomb friction is not
measurable.
"""

VISCOUS = Parameter(name="viscous", symbol="Fv", unit="N m s/rad")
COULOMB = Parameter(name="coulomb", symbol="Fc", unit="N m")
OFFSET = Parameter(name="offset", symbol="tau_os", unit="N m", lower=-np.inf, neutral=0.0)
STRIBECK_GAIN = Parameter(name="stribeck_gain", symbol="S", unit="1", upper=MAX_GAIN)
STRIBECK_VELOCITY = Parameter(
    name="stribeck_velocity",
    symbol="vs",
    unit="rad/s",
    lower=1e-4,
    upper=1e2,
    starts=(0.03, 0.1, 0.3, 0.7),
    start_speed_power=1,
    logarithmic=True,
)
SLOPE = Parameter(
    name="slope",
    symbol="a",
    unit="s/rad",
    lower=1e-1,
    upper=1e4,
    starts=(10.0, 60.0, 400.0),
    start_speed_power=-1,
    logarithmic=True,
)
