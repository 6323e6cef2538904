"""Units of a log that its own numbers give away."""

import numpy as np

from stribeck.log import RobotLog
from stribeck.log.clock import RATES
from stribeck.log.plausibility import AGREEMENT, position_slope
from stribeck.robot import Robot
from stribeck.typing import Array


def time_unit(stamps: Array) -> str:
    """Return the largest unit of time in which stamps are those of a robot's log; seconds if none is."""
    steps = np.diff(stamps[np.isfinite(stamps)])
    steps = steps[steps > 0]
    step = float(np.median(steps)) if len(steps) else 1.0
    factors = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
    return next((unit for unit, factor in factors.items() if RATES[0] <= 1 / (step * factor) <= RATES[1]), "s")


def orientation_order(log: RobotLog) -> str:
    """Return "wxyz" if the base is upright with the quaternions' scalar first alone, else nothing."""
    if log.base_orientation is None:
        return ""
    x, y, z = log.base_orientation.T[:3]
    upright, first = np.nanmedian(1 - 2 * (x**2 + y**2)), np.nanmedian(1 - 2 * (y**2 + z**2))
    return "wxyz" if first > upright + 0.7 else ""


def position_and_velocity_units(log: RobotLog, robot: Robot) -> list[tuple[str, str, str]]:
    """Return channel, unit and evidence where positions or velocities are not in radians."""
    low, high = robot.position_limits
    lowest, highest = np.nanmin(log.position, axis=0), np.nanmax(log.position, axis=0)
    turning = ~np.array(robot.prismatic)
    limited = turning & np.isfinite(low) & np.isfinite(high) & (highest - lowest > 0.02)
    wide = limited & ((lowest < low - 1.0) | (highest > high + 1.0))  # [rad]
    fits = (np.deg2rad(lowest) > low - 0.1) & (np.deg2rad(highest) < high + 0.1)
    speed = np.nanpercentile(np.abs(np.diff(log.position, axis=0)), 99, axis=0) / np.nanmedian(np.diff(log.time))
    degrees = wide.sum() >= max(1, 0.5 * limited.sum()) and bool(np.all(fits[limited]))
    # Without limits, joints faster than 60 rad/s are in degrees.
    degrees |= not limited.any() and np.count_nonzero(turning & (speed > 60.0)) >= max(1, 0.5 * turning.sum())
    why = "the positions are outside of the model's limits as radians, and within them as degrees."
    position, velocity = "deg" if degrees else "rad", "deg/s" if degrees else "rad/s"
    if log.velocity is not None:
        slopes = np.array([position_slope(log, joint) for joint in range(len(log.joint_names))])
        middle = float(np.median(slopes[np.isfinite(slopes)])) if np.isfinite(slopes).any() else 1.0
        units_by_slope = {
            180 / np.pi: ("deg", "rad/s"),
            np.pi / 180: ("rad", "deg/s"),
            np.pi / 30: ("rad", "rpm"),
            6.0: ("deg", "rpm"),
        }
        for ratio, units in units_by_slope.items():
            if abs(abs(middle) / ratio - 1) < AGREEMENT:
                position, velocity = units
                why = f"the positions change {middle:.4g} times as fast as the velocities say."
    found = [("position", position, why)] if position != "rad" else []
    return found + ([("velocity", velocity, why)] if log.velocity is not None and velocity != "rad/s" else [])
