"""Checks of positions: jumps of a full turn, degrees, and positions outside the model's limits or at their ends."""

from collections.abc import Collection

import numpy as np

from stribeck.check.audit.evidence import AuditData
from stribeck.check.audit.units import concerns_most
from stribeck.core.base.finding import Finding, Setting
from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.robot import Robot
from stribeck.core.robot.scale_setting import scale_setting

OUTSIDE = 0.25
"""Distance outside the range beyond which no stop is plausible [rad] or [m]."""


def check_positions(evidence: AuditData) -> list[Finding]:
    """Report faults of the positions; degrees hide all others."""
    jumps = _jumps(evidence)
    if not jumps and (degrees := _degrees(evidence)):
        return degrees
    lengths = in_millimeters(evidence.robot, *evidence.position_range)
    if lengths.any():
        names = [name for name, wrong in zip(evidence.robot.joint_names, lengths, strict=True) if wrong]
        setting = scale_setting(evidence.robot, dict.fromkeys(names, 1e-3), "position")
        return [Finding.of("position-limits.millimeters", names, stops=True, settings=[setting])]
    return [*jumps, *_limits(evidence, {name for finding in jumps for name in finding.joints})]


def _jumps(evidence: AuditData) -> list[Finding]:
    """Report revolute joints whose position jumps by a full turn, within four samples that resampling may smear."""
    log, robot = evidence.prepared.log, evidence.robot
    lowest, highest = evidence.position_range
    jumps = {}
    for column, name in enumerate(robot.joint_names):
        if robot.prismatic[column] or highest[column] - lowest[column] < 0.9 * 2 * np.pi:
            continue
        position = log.position[:, column]
        count = 0
        for segment in evidence.prepared.sampling.segments:
            steps = np.abs(position[segment][4:] - position[segment][:-4])
            if len(steps) and np.median(steps) < 0.3:
                jumping = np.abs(steps - 2 * np.pi) < 0.3
                count += int(np.count_nonzero(np.diff(jumping.astype(np.int8)) > 0))
        if count:
            jumps[name] = f" ({count} times)"
    stops = concerns_most(len(jumps), len(robot.joint_names), robot.joint_names)
    unwrap = Setting("log.position", "unwrap", True)
    return [Finding.of("position-jump", jumps, stops=stops, settings=[unwrap])] if jumps else []


def _degrees(evidence: AuditData) -> list[Finding]:
    """Report positions that fit the model's limits as degrees but not as radians."""
    log, robot = evidence.prepared.log, evidence.robot
    lowest, highest = evidence.position_range
    steps = np.percentile(np.abs(np.diff(log.position[:6000], axis=0)), 99, axis=0)
    wrong = in_degrees(robot, lowest, highest, steps / evidence.prepared.sampling.period)
    if not wrong.any():
        return []
    channels = {"position": "deg"} | ({"desired_position": "deg"} if log.command is not None else {})
    channels |= {"velocity": "deg/s"} if log.velocity is not None else {}
    turning = {name: np.pi / 180 for name, slides in zip(robot.joint_names, robot.prismatic, strict=True) if not slides}
    units = [Setting(f"log.{channel}", "unit", unit) for channel, unit in channels.items()]
    if any(robot.prismatic):  # a unit would apply to these as well
        units = [scale_setting(robot, turning, channel, digits=6) for channel in channels]
    reach = float(np.maximum(-lowest, highest)[~np.array(robot.prismatic)].max())
    names = [robot.joint_names[k] for k in np.flatnonzero(wrong)]
    return [Finding.of("position-degrees", names, reach=reach, settings=units)]


def in_degrees(robot: Robot, lowest: Array, highest: Array, speed: Array) -> BoolArray:
    """Find the joints that are outside their limits or too fast as radians, if most of them fit as degrees, shape (n,).

    `speed` is each joint's top speed [rad/s].
    """
    low, high = robot.position_limits
    turning = ~np.array(robot.prismatic)
    limited = turning & np.isfinite(low) & np.isfinite(high)
    excess = _excess(lowest, highest, low, high)
    distances = _excess(np.deg2rad(lowest), np.deg2rad(highest), low, high)[limited]
    wide, fast = limited & (excess > 1.0), turning & (speed > 60.0)  # rad/s: faster than any joint
    moving = turning & (highest - lowest > 0.02)
    few = 0.02  # largest distance outside the limits in degrees relative to the distance in radians [1]
    fits = distances.sum() < few * excess[limited].sum() or np.count_nonzero(distances >= 0.1) <= 0.1 * len(distances)
    if fits and np.count_nonzero(wide) >= max(1, 0.5 * np.count_nonzero(limited & moving)):
        return wide
    of_speed = not limited.any() and np.count_nonzero(fast) >= max(1, 0.5 * np.count_nonzero(moving))
    return fast & of_speed


def in_millimeters(robot: Robot, lowest: Array, highest: Array) -> BoolArray:
    """Find the prismatic joints whose positions fit the model's limits only as millimeters, shape (n,)."""
    low, high = robot.position_limits
    far = (lowest < low - OUTSIDE) | (highest > high + OUTSIDE)
    return np.array(robot.prismatic) & far & (1e-3 * lowest > low - 0.01) & (1e-3 * highest < high + 0.01)


def _excess(lowest: Array, highest: Array, low: Array, high: Array) -> Array:
    """Compute how far each joint moves outside its limits [rad], shape (n,)."""
    return np.maximum(0.0, np.maximum(low - lowest, highest - high))


def _limits(evidence: AuditData, left_out: Collection[str]) -> list[Finding]:
    """Report joints that leave their range, or reach its end, where a stop would carry part of the torque."""
    robot = evidence.robot
    low, high = robot.position_limits
    lowest, highest = evidence.position_range
    other = np.array([name not in left_out for name in robot.joint_names])
    margin = 1e-3  # rad or m
    reached = other & ((lowest < low + margin) | (highest > high - margin))
    beyond = _excess(lowest, highest, low, high)
    elastic = 0.03  # distance by which a stop gives way [rad], [m]; joints that move further have no stop at the limit
    outside, stopped = reached & (beyond > OUTSIDE), reached & (beyond < elastic)

    def finding(check: str, joints: BoolArray) -> list[Finding]:
        spans = {
            robot.joint_names[k]: f" ({lowest[k]:.3g} to {highest[k]:.3g}, limits {low[k]:.3g} to {high[k]:.3g})"
            for k in np.flatnonzero(joints)
        }
        return [Finding.of(check, spans)] if spans else []

    return [*finding("position-limits", outside), *finding("position-stop", stopped)]
