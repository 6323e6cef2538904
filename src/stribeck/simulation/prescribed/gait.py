"""Gaits: alternating steps, a trot, or standing still."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError
from stribeck.simulation.prescribed.trajectory import bell, smooth_step

Gait = Literal["walk", "trot", "stand"]

TROT_SWING_TIME = 0.4
"""Duration of a swing in a trot [s]; longer swings would tip the robot over the other two feet."""
STAND_TIME = 0.2
"""Duration of standing on all feet between two steps [s]."""


@dataclass(frozen=True)
class Swing:
    """Feet that are in the air from `start` to `end` [s]."""

    start: float
    end: float
    feet: tuple[str, ...]


def plan_swings(gait: Gait, feet: tuple[str, ...], duration: float) -> tuple[Swing, ...]:
    """Build the swings of a gait within `duration` [s]; all feet stand before, between and after them.

    A walk swings one foot after the other, in their order; a trot the outer and the inner pair of four feet in turn.

    Raises
    ------
    SettingsError
        If a robot without four feet should trot.
    """
    if gait == "stand":
        return ()
    if gait == "trot" and len(feet) != 4:
        raise SettingsError(f"gait: 'trot' needs four contacts, the robot has {len(feet)}; expected 'walk' or 'stand'")
    groups = [(feet[0], feet[3]), (feet[1], feet[2])] if gait == "trot" else [(foot,) for foot in feet]
    time = TROT_SWING_TIME if gait == "trot" else 0.9  # duration of a swing [s]
    swings: list[Swing] = []
    start = STAND_TIME
    while start + time + STAND_TIME <= duration:
        swings.append(Swing(start, start + time, groups[len(swings) % len(groups)]))
        start += time + STAND_TIME
    return tuple(swings)


def in_the_air(swings: tuple[Swing, ...], foot: str, time: Array) -> NDArray[np.bool_]:
    """Check whether a foot is in the air at these times, shape (T,)."""
    flying = np.zeros(len(time), dtype=bool)
    for swing in swings:
        if foot in swing.feet:
            flying |= (time >= swing.start) & (time < swing.end)
    return flying


def swing_window(swings: tuple[Swing, ...], foot: str, time: Array) -> Array:
    """Compute the swing of a foot's limb from 0 (foot stands) to 1, with derivatives, shape (3, T, 1)."""
    total = np.zeros((3, len(time)))
    for swing in swings:
        if foot in swing.feet:
            total += bell(time, swing.start, swing.end)
    return total[:, :, None]


def load_share(swings: tuple[Swing, ...], foot: str, time: Array) -> Array:
    """Compute the weight of a foot in the load distribution, shape (T,): 0 in the air, 1 long before and after."""
    share = np.ones(len(time))
    for swing in swings:
        if foot in swing.feet:
            before = smooth_step(time, swing.start - STAND_TIME, swing.start)
            after = smooth_step(time, swing.end, swing.end + STAND_TIME)
            share *= 1 - before + after
    return share
