"""A joint that friction alone brings to rest, in steps of fixed length.

Near standstill the law (3.5) is a damper of k = a Fc (1 + S) + Fv. An explicit step of length h multiplies a small
velocity by 1 - k h / I: beyond k h / I = 1 it turns the joint round, and beyond 2 it makes it faster, until tanh
bends. The joint then never rests, and its friction torque has another sign every step. An implicit step divides by
1 + k h / I.
"""

from __future__ import annotations

import numpy as np

from stribeck.friction import get_law
from stribeck.log import Array
from stribeck.simulation.friction_truth import FrictionTruth, Instant, LawFriction
from studies.paper.laws import KNEE, STATIC

STEP = 1e-3
"""The paper's [s]."""


def stiffness(slope: float) -> float:
    """Return the damping of the knee's law at standstill, k [N m s/rad]."""
    return slope * STATIC + KNEE["viscous"]


def coast(inertia: float, slope: float, *, implicit: bool, start: float, duration: float, step: float = STEP) -> Array:
    """Return the velocities [rad/s] of a joint that friction alone brings to rest, one a step, its start first.

    Parameters
    ----------
    inertia
        [kg m^2]
    slope
        Of the law, a [s/rad]; infinite for the law that jumps (3.3).
    implicit
        Whether friction is that of the step's end, as the simulators of this package have it, or of its beginning.
    start, duration, step
        [rad/s], [s], [s]
    """
    law = get_law("stribeck" if np.isfinite(slope) else "stribeck-exponent")
    named = KNEE | ({"slope": slope} if np.isfinite(slope) else {"exponent": 2.0})
    values = np.array([named[parameter.name] for parameter in law.parameters])
    truth = FrictionTruth(1, [LawFriction(["joint"], law, {"joint": named})])
    velocity = np.empty((round(duration / step) + 1, 1))
    velocity[0] = start
    nothing = np.zeros(1)
    for k, now in enumerate(velocity[:-1]):
        if implicit:
            moment = Instant(time=k * step, step=step, position=nothing, velocity=now, torque=nothing)
            damping, constant = truth.before(moment)
            velocity[k + 1] = (inertia * now - step * constant) / (inertia + step * damping)
        else:
            velocity[k + 1] = now - step / inertia * law.torque(now, values)
    return velocity[:, 0]


def chatter(velocity: Array, samples: int = 50) -> float:
    """Return the amplitude [rad/s] with which the last samples go to and fro; 0 for a joint that rests or crawls."""
    swing = float(np.abs(np.diff(velocity[-samples:])).max()) / 2
    return swing if np.any(velocity[-samples:-1] * velocity[1 - samples :] < 0) and swing > 1e-9 else 0.0


def least_inertia(slope: float, step: float = STEP) -> float:
    """Return the inertia [kg m^2] below which an explicit step chatters."""
    return stiffness(slope) * step / 2
