"""Desired pose, velocity and acceleration of the swing foot at one instant."""

from dataclasses import dataclass

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.simulation.walking.footsteps import Footprint

LIFT = 0.05
"""Share of the swing before the foot moves over the ground."""
LANDED = 0.92
"""Share of the swing after which the foot moves only down."""

PRESS = 0.001
"""Depth of the swing's target below the ground [m], so that the foot reaches the ground despite friction."""


@dataclass(frozen=True, eq=False)
class Swing:
    """Position [m], velocity and acceleration of a sole's center, shape (3,) each; heading and its rates."""

    place: Array
    velocity: Array
    acceleration: Array
    yaw: float
    yaw_rate: float


def swing_at(start: Array, start_yaw: float, goal: Footprint, height: float, progress: float, duration: float) -> Swing:
    """Compute the swing from a position to a footprint.

    The horizontal motion has minimum jerk from `LIFT` to `LANDED`. The height is `64 height (s (1 - s))^3` plus a
    smooth change of level.

    Parameters
    ----------
    start, start_yaw
        Position [m], shape (3,), and heading [rad] of the sole's center when it left the ground.
    goal
        Target footprint, slightly below z = 0.
    height
        Height above the ground in the middle of the swing [m].
    progress
        Progress of the swing, 0 to 1.
    duration
        Duration of the swing [s].
    """
    span = LANDED - LIFT
    share, rate, change = _min_jerk(min(max((progress - LIFT) / span, 0.0), 1.0), span * duration)
    way = np.array([goal.x - start[0], goal.y - start[1], 0.0])
    place, velocity, acceleration = start + share * way, rate * way, change * way
    level, level_rate, level_change = _min_jerk(progress, duration)
    bump, bump_rate, bump_change = _bump(progress, duration)
    fall = start[2] + PRESS
    place[2] = height * bump + start[2] - level * fall
    velocity[2] = height * bump_rate - level_rate * fall
    acceleration[2] = height * bump_change - level_change * fall
    turn = goal.yaw - start_yaw
    return Swing(place, velocity, acceleration, start_yaw + share * turn, rate * turn)


def _min_jerk(s: float, duration: float) -> tuple[float, float, float]:
    return (
        s**3 * (10 - 15 * s + 6 * s**2),
        30 * s**2 * (1 - s) ** 2 / duration,
        60 * s * (1 - s) * (1 - 2 * s) / duration**2,
    )


def _bump(s: float, duration: float) -> tuple[float, float, float]:
    arch, slope = s * (1 - s), 1 - 2 * s
    return (
        64 * arch**3,
        192 * arch**2 * slope / duration,
        (384 * arch * slope**2 - 384 * arch**2) / duration**2,
    )
