"""Units of torques, and settings that correct the scale of a channel."""

from collections.abc import Mapping, Sequence

import numpy as np

from stribeck.base.finding import Setting, rounded
from stribeck.robot import Robot

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
    near = [
        f"{unit} (scale = {1 / ratio:.4g})" for ratio, unit in UNITS.items() if abs(np.log(factor / ratio)) < NEARBY
    ]
    return ", ".join([*near, *causes])


def unit_of(factor: float) -> float | None:
    """Find the unit in `UNITS` that makes torques larger by a factor; None if none does."""
    nearest = min(UNITS, key=lambda ratio: abs(np.log(factor / ratio)))
    return nearest if abs(np.log(factor / nearest)) < (NEARBY if nearest in (1e3, 1e-3) else EXACT) else None


def scale_setting(robot: Robot, factors: Mapping[str, float], channel: str = "torque") -> Setting:
    """Make the setting that multiplies a channel by a factor per joint, in addition to the present scale.

    It is one number if all joints with a torque have the same factor, otherwise one value per joint name of the log;
    without a value if the present scale is a list in the log's joint order.
    """
    table, present = f"log.{channel}", getattr(robot.log_table, channel).scale
    joints = [robot.joint_names[column] for column in robot.torque_controlled]
    if isinstance(present, list):
        return Setting(table, "scale")
    if set(factors) == set(joints) and len(set(factors.values())) == 1 and not isinstance(present, dict):
        return Setting(table, "scale", rounded(present * next(iter(factors.values())), 4))
    logged = {model: name for name, model in robot.log_table.joint_names.items()}
    scales = {}
    for joint in joints:
        name = logged.get(joint, joint)
        before = present.get(name, 1.0) if isinstance(present, dict) else present
        if joint in factors or before != 1:
            scales[name] = rounded(before * factors.get(joint, 1.0), 4)
    return Setting(table, "scale", scales)
