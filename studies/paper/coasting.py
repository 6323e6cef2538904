"""A joint that friction alone brings to rest, in steps of fixed length.

Near standstill the law (3.5) is a damper of k = a Fc (1 + S) + Fv. With x = k h / I, an explicit step of length h
multiplies a small velocity by 1 - x: beyond x = 1 it turns the joint round, and beyond 2 it makes it faster, until tanh
bends. The joint then never rests, and its friction torque has another sign every step. A step with the friction of its
middle, which is yet to be found, multiplies by (1 - x / 2) / (1 + x / 2), which is never larger than 1.
"""

import numpy as np

from stribeck.base.typing import Array
from stribeck.friction import get_law
from stribeck_simulation.friction import FrictionTruth, Instant, LawFriction
from stribeck_simulation.rigid.constrained import ITERATIONS
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
        Whether friction is that of the step's middle, as in the simulators of this package, or of its beginning.
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
    """Return the amplitude [rad/s] with which the last samples go to and fro; 0 for a joint that rests or crawls."""
    swing = float(np.abs(np.diff(velocity[-samples:])).max()) / 2
    return swing if np.any(velocity[-samples:-1] * velocity[1 - samples :] < 0) and swing > 1e-6 else 0.0


def least_inertia(slope: float, step: float = STEP) -> float:
    """Return the inertia [kg m^2] below which an explicit step chatters."""
    return stiffness(slope) * step / 2
