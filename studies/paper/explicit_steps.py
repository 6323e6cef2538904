"""Section 3.3: a joint that coasts to rest by the smooth law, integrated with fixed steps.

Near standstill the law (3.5) is a damper with k = a Fc (1 + S) + Fv. With x = k h / I, an explicit step of length h
multiplies a small velocity by 1 - x. If x > 1, the step reverses the joint; if x > 2, it also accelerates the joint
until tanh saturates. The joint then never rests, and its friction torque changes sign every step. An implicit midpoint
step multiplies the velocity by (1 - x / 2) / (1 + x / 2), whose magnitude never exceeds 1.
"""

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.friction import get_law
from stribeck.simulation.friction import FrictionTruth, Instant, LawFriction
from stribeck.simulation.rigid.constrained import ITERATIONS
from studies.paper.laws import KNEE, SLOPE, STATIC
from studies.paper.study import Numbers

WALKS = ()
STEP = 1e-3
"""Step of the paper [s]."""
INERTIAS = {"foot": 0.01, "forearm": 0.1, "shank": 0.5}
"""Inertia moved by the ankle pitch, elbow and knee of a TORO-like humanoid's swinging limbs [kg m^2]."""
SLOPES = {"10": 10.0, "20": 20.0, "40": 40.0, "100": 100.0, "300": 300.0, "1000": 1000.0, "the jump": np.inf}
"""Slopes of the law [s/rad]."""
START = 0.5
"""Velocity from which joints coast [rad/s]."""


def coast(inertia: float, slope: float, *, implicit: bool, duration: float) -> Array:
    """Simulate a joint that coasts to rest by friction; return its velocity at every step, starting at `START`.

    Parameters
    ----------
    inertia
        Inertia of the joint [kg m^2].
    slope
        Slope a of the law [s/rad]; infinite for the law that jumps (3.3).
    implicit
        Whether friction is evaluated at the middle of the step, as in this package's simulators, or at its start.
    duration
        Simulated time [s].
    """
    law = get_law("stribeck" if np.isfinite(slope) else "stribeck-exponent")
    named = KNEE | ({"slope": slope} if np.isfinite(slope) else {"exponent": 2.0})
    values = np.array([named[parameter.name] for parameter in law.parameters])
    truth = FrictionTruth(1, [LawFriction(["joint"], law, {"joint": named})])
    velocity = np.empty((round(duration / STEP) + 1, 1))
    velocity[0] = START
    nothing = np.zeros(1)
    for k, now in enumerate(velocity[:-1]):
        if not implicit:
            velocity[k + 1] = now - STEP / inertia * law.torque(now, values)
            continue
        middle = now
        for _ in range(ITERATIONS):
            moment = Instant(time=k * STEP, step=STEP, position=nothing, velocity=middle, torque=nothing)
            damping, constant = truth.before(moment)
            middle = (inertia * now - STEP / 2 * constant) / (inertia + STEP / 2 * damping)
        velocity[k + 1] = 2 * middle - now
    return velocity[:, 0]


def chatter(velocity: Array, samples: int = 50) -> float:
    """Compute the amplitude of alternating velocities in the last samples [rad/s]; 0 if the joint rests or creeps."""
    swing = float(np.abs(np.diff(velocity[-samples:])).max()) / 2
    return swing if np.any(velocity[-samples:-1] * velocity[1 - samples :] < 0) and swing > 1e-6 else 0.0


def least_inertia(slope: float) -> float:
    """Compute the inertia [kg m^2] below which an explicit step chatters."""
    return (slope * STATIC + KNEE["viscous"]) * STEP / 2


def integration(inertia: float, slope: float) -> dict[str, float]:
    """Compute the final velocity amplitude [rad/s] of a joint that should be at rest."""
    duration = START * inertia / KNEE["coulomb"] + 0.5
    ways = {"explicit": False, "implicit": True}
    return {name: chatter(coast(inertia, slope, implicit=way, duration=duration)) for name, way in ways.items()}


def run(quick: bool) -> Numbers:  # noqa: ARG001 - it takes seconds
    return {
        "least_inertia": {name: least_inertia(slope) for name, slope in SLOPES.items() if np.isfinite(slope)},
        "integration": {
            place: {name: integration(inertia, slope) for name, slope in SLOPES.items()}
            for place, inertia in INERTIAS.items()
        },
    }


def texts(numbers: Numbers) -> dict[str, str]:
    jump = {place: each["the jump"]["explicit"] for place, each in numbers["integration"].items()}
    return {
        "jump": f"{jump['shank']:.4f} to {jump['foot']:.2f} rad/s",
        "least-inertia": f"{numbers['least_inertia'][f'{SLOPE:g}']:.3f} kg m²",
    }
