"""Simulation of a joint that coasts to rest by friction, with a fixed step.

Near standstill the law (3.5) is a damper with k = a Fc (1 + S) + Fv. With x = k h / I, an explicit step of length h
multiplies a small velocity by 1 - x. If x > 1, the step reverses the joint; if x > 2, it also accelerates the joint
until tanh saturates. The joint then never rests, and its friction torque changes sign every step. An implicit midpoint
step multiplies the velocity by (1 - x / 2) / (1 + x / 2), whose magnitude never exceeds 1.
"""

import numpy as np

from stribeck.base.typing import Array
from stribeck.friction import get_law
from stribeck_simulation.friction import FrictionTruth, Instant, LawFriction
from stribeck_simulation.rigid.constrained import ITERATIONS
from studies.paper.laws import KNEE, STATIC

STEP = 1e-3
"""Step of the paper [s]."""


def stiffness(slope: float) -> float:
    """Compute the damping of the knee's law at standstill, k [N m s/rad]."""
    return slope * STATIC + KNEE["viscous"]


def coast(inertia: float, slope: float, *, implicit: bool, start: float, duration: float, step: float = STEP) -> Array:
    """Simulate a joint that coasts to rest by friction; return its velocity at every step, starting at `start` [rad/s].

    Parameters
    ----------
    inertia
        Inertia of the joint [kg m^2].
    slope
        Slope a of the law [s/rad]; infinite for the law that jumps (3.3).
    implicit
        Whether friction is evaluated at the middle of the step, as in this package's simulators, or at its start.
    start, duration, step
        Initial velocity [rad/s], duration [s], step [s].
    """
    law = get_law("stribeck" if np.isfinite(slope) else "stribeck-exponent")
    named = KNEE | ({"slope": slope} if np.isfinite(slope) else {"exponent": 2.0})
    values = np.array([named[parameter.name] for parameter in law.parameters])
    truth = FrictionTruth(1, [LawFriction(["joint"], law, {"joint": named})])
    velocity = np.empty((round(duration / step) + 1, 1))
    velocity[0] = start
    nothing = np.zeros(1)
    for k, now in enumerate(velocity[:-1]):
        if not implicit:
            velocity[k + 1] = now - step / inertia * law.torque(now, values)
            continue
        middle = now
        for _ in range(ITERATIONS):
            moment = Instant(time=k * step, step=step, position=nothing, velocity=middle, torque=nothing)
            damping, constant = truth.before(moment)
            middle = (inertia * now - step / 2 * constant) / (inertia + step / 2 * damping)
        velocity[k + 1] = 2 * middle - now
    return velocity[:, 0]


def chatter(velocity: Array, samples: int = 50) -> float:
    """Compute the amplitude of alternating velocities in the last samples [rad/s]; 0 if the joint rests or creeps."""
    swing = float(np.abs(np.diff(velocity[-samples:])).max()) / 2
    return swing if np.any(velocity[-samples:-1] * velocity[1 - samples :] < 0) and swing > 1e-6 else 0.0


def least_inertia(slope: float, step: float = STEP) -> float:
    """Compute the inertia [kg m^2] below which an explicit step chatters."""
    return stiffness(slope) * step / 2
