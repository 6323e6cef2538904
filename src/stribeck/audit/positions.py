"""Positions: jumps of a turn, degrees, and what lies outside of the model's limits or at their ends."""

from collections.abc import Collection

import numpy as np

from stribeck.audit.cures import listed
from stribeck.audit.evidence import Evidence
from stribeck.finding import Finding

STOP_MARGIN = 1e-3
"""[rad] or [m]"""
OUTSIDE = 0.25
"""[rad] or [m]: further outside of the range there is no stop any more."""
TURN = 2 * np.pi
JUMP_ROWS = 4
"""Samples over which a jump may be smeared by an even clock."""
SPEED_ROWS = 6000
"""That speeds are looked at over."""
TOO_FAST = 60.0
"""[rad/s]: the top speed of a joint whose position may be in degrees."""


def check_positions(evidence: Evidence) -> list[Finding]:
    """Return what is wrong with positions."""
    degrees = _degrees(evidence)
    if degrees:
        return degrees
    jumps = _jumps(evidence)
    return [*jumps, *_limits(evidence, {name for finding in jumps for name in finding.joints})]


def _jumps(evidence: Evidence) -> list[Finding]:
    """Return a finding on revolute joints whose position jumps by a turn."""
    log, robot = evidence.prepared.log, evidence.robot
    lowest, highest = evidence.position_range
    span = highest - lowest
    found = []
    for column, name in enumerate(robot.joint_names):
        if robot.prismatic[column] or span[column] < 0.9 * TURN:
            continue
        position = log.position[:, column]
        count = 0
        for segment in evidence.prepared.sampling.segments:
            steps = np.abs(position[segment][JUMP_ROWS:] - position[segment][:-JUMP_ROWS])
            if len(steps) and np.median(steps) < 0.3:
                jumping = np.abs(steps - TURN) < 0.3
                count += int(np.count_nonzero(np.diff(jumping.astype(np.int8)) > 0))
        if count:
            found.append((name, count))
    if not found:
        return []
    return [
        Finding(
            check="position-jump",
            channel="position",
            text=f"positions jump by a turn: {listed([f'{name} ({count} times)' for name, count in found])}",
            cure="set [log.position] unwrap = true",
            joints=tuple(name for name, _ in found),
        )
    ]


def _degrees(evidence: Evidence) -> list[Finding]:
    """Return a finding if positions fit the model's limits as degrees, and not as radians."""
    log, robot = evidence.prepared.log, evidence.robot
    low, high = robot.position_limits
    turning = ~np.array(robot.prismatic)
    lowest, highest = evidence.position_range
    limited = turning & np.isfinite(low) & np.isfinite(high)
    wide = limited & ((lowest < low - 1) | (highest > high + 1))
    as_degrees = np.deg2rad(1.0)
    fits = (lowest * as_degrees > low - 0.1) & (highest * as_degrees < high + 0.1)
    far = int(np.count_nonzero(wide & fits))
    speeds = (
        np.percentile(np.abs(np.diff(log.position[:SPEED_ROWS], axis=0)), 99, axis=0)
        / evidence.prepared.sampling.period
    )
    fast = turning & (speeds > TOO_FAST)
    moving = turning & (highest - lowest > 0.02)
    of_limits = far >= max(1, 0.5 * np.count_nonzero(limited & moving)) and bool(np.all(fits[limited]))
    of_speed = not limited.any() and np.count_nonzero(fast) >= max(1, 0.5 * np.count_nonzero(moving))
    if not of_limits and not of_speed:
        return []
    names = [robot.joint_names[k] for k in np.flatnonzero(wide if of_limits else fast)]
    reach = float(np.maximum(-lowest, highest)[turning].max())
    return [
        Finding(
            check="position-degrees",
            channel="position",
            text=f"positions reach {reach:.4g}, outside of the model's limits, but within them as degrees: "
            f"{listed(names)}",
            cure='set [log.position] unit = "deg"',
            joints=tuple(names),
            stops=True,
        )
    ]


def _limits(evidence: Evidence, left_out: Collection[str]) -> list[Finding]:
    """Return findings on joints that leave their range, or reach its end, where a stop takes part of the torque."""
    robot = evidence.robot
    low, high = robot.position_limits
    lowest, highest = evidence.position_range
    other = np.array([name not in left_out for name in robot.joint_names])
    reached = other & ((lowest < low + STOP_MARGIN) | (highest > high - STOP_MARGIN))
    outside = reached & ((lowest < low - OUTSIDE) | (highest > high + OUTSIDE))

    def spans(rows: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> str:
        return listed(
            [
                f"{robot.joint_names[k]} ({lowest[k]:.3g} to {highest[k]:.3g}, limits {low[k]:.3g} to {high[k]:.3g})"
                for k in np.flatnonzero(rows)
            ]
        )

    found = []
    if outside.any():
        found.append(
            Finding(
                check="position-limits",
                channel="position",
                text=f"positions lie outside of the model's limits: {spans(outside)}",
                cure="see zero, sign, unit and order: [log.position] offset, scale, unit; [log] joint_names",
                joints=tuple(robot.joint_names[k] for k in np.flatnonzero(outside)),
            )
        )
    if (reached & ~outside).any():
        found.append(
            Finding(
                check="position-stop",
                channel="position",
                text="joints reach the end of their range in the model, where a stop would take part of the torque: "
                + spans(reached & ~outside),
                cure="keep joints off the ends of their range, or leave that part of the log out",
                joints=tuple(robot.joint_names[k] for k in np.flatnonzero(reached & ~outside)),
            )
        )
    return found
