"""Curves of the laws of Chapter 3, with the parameters of the paper's knee."""

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.friction import LAWS, get_law
from stribeck.simulation.friction import FrictionTruth, Instant, LuGre

KNEE = {"viscous": 0.2, "coulomb": 1.0, "stribeck_gain": 0.2, "stribeck_velocity": 0.2, "offset": 0.0}
"""Parameters of Table 6.1 in the laws' units, without offset for point-symmetric curves."""
SLOPE = 40.0
"""Slope a of the paper [s/rad]."""
STATIC = KNEE["coulomb"] * (1 + KNEE["stribeck_gain"])
"""Static friction [N m]."""
BRISTLES = {"bristle_stiffness": 300.0, "bristle_damping": 2.0, **KNEE}
"""Parameters of LuGre with the bristles of the scenarios' hips [N m/rad], [N m s/rad]."""
STEP = 2e-4
"""Integration step of LuGre's state [s]."""


def values(law: str, **changes: float) -> Array:
    """Arrange the knee's parameters, with some changes, in the order of a law."""
    known = KNEE | {"slope": SLOPE, "exponent": 2.0}
    known |= {f"{name}_{side}": known[name] for name in ("viscous", "coulomb") for side in ("positive", "negative")}
    return np.array([(known | changes)[parameter.name] for parameter in LAWS[law].parameters])


def curve(law: str, velocity: Array, **changes: float) -> Array:
    """Compute a law's friction torque [N m], shape (N,)."""
    return get_law(law).torque(velocity, values(law, **changes))


def speeds() -> Array:
    """Compute velocities on both sides of standstill [rad/s], denser near standstill, none at it."""
    half = np.concatenate([np.geomspace(1e-4, 0.05, 60), np.linspace(0.052, 1.0, 120)])
    return np.concatenate([-half[::-1], half])


def lugre(velocity: Array) -> Array:
    """Compute LuGre's friction torque [N m] along a velocity [rad/s] that starts at rest, every `STEP`, shape (N,)."""
    truth = FrictionTruth(1, [LuGre(["joint"], {"joint": BRISTLES})])
    torque = np.empty_like(velocity)
    nothing, before = np.zeros(1), np.zeros(1)
    for k, now in enumerate(velocity[:, None]):  # the state depends on the previous sample
        truth.before(Instant(time=k * STEP, step=STEP, position=nothing, velocity=before, torque=nothing))
        torque[k], before = truth.after(now)[0], now
    return torque
