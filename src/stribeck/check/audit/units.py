"""Units of torques, and settings that correct the scale of a channel."""

from collections.abc import Sequence

import numpy as np

FAR = 5.0
"""Factor [1] of most joints' gains that makes the log unusable; effort limits and weights have smaller errors."""
MOST = 0.6
"""Share of the joints with evidence [1] above which a cause concerns all joints."""
EXACT, NEARBY = 0.03, 0.15
"""Largest logarithm of a factor relative to a unit's [1]: such that it is this unit, or may be. Units that are a power
of 1000 may be missed by more, because no other cause comes close."""
UNITS = {1000.0: "N mm or mN m", 1e-3: "kN m", 100.0: "N cm", 0.10197: "kgf m", 10.197: "kgf cm", 10197.0: "gf cm"}
UNITS |= {8.851: "in lbf", 0.7376: "ft lbf", 141.6: "oz in"}
"""Factor relative to N m -> unit."""


def concerns_most(count: int, examined: int, joints: Sequence[object]) -> bool:
    """Whether a cause concerns most of the examined joints, and at least two, unless the robot has one."""
    return count >= max(min(2, len(joints)), MOST * examined)


def possible_causes(factor: float | None) -> str:
    """List causes of a factor of all torques that is no unit; None if each joint has its own factor."""
    causes = ['currents (unit = "A" in [log.torque])', "torques before the gear (their scale is the gear ratio)"]
    if factor is None:
        return ", ".join([*causes, "or shares of each joint's rated torque"])
    causes += ['positions in another unit (unit = "turn" or "deg" in [log.position])', "or wrong masses of the model"]
    near = {ratio: unit for ratio, unit in UNITS.items() if abs(np.log(factor / ratio)) < NEARBY}
    return ", ".join([*(f"{unit} (scale = {1 / ratio:.4g})" for ratio, unit in near.items()), *causes])


def unit_of(factor: float) -> float | None:
    """Find the unit in `UNITS` that makes torques larger by a factor; None if none does."""
    nearest = min(UNITS, key=lambda ratio: abs(np.log(factor / ratio)))
    return nearest if abs(np.log(factor / nearest)) < (NEARBY if nearest in (1e3, 1e-3) else EXACT) else None
