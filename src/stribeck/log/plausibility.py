"""Plausibility checks of a log's values, given their names and units."""

import numpy as np

from stribeck.base.typing import Array
from stribeck.errors import LogError
from stribeck.log import RobotLog
from stribeck.log.readers.recording import listed

ROWS = 50_000  # for the comparison of units
AGREEMENT = 0.05  # relative tolerance for the ratio of two units
RATIOS = {
    180 / np.pi: 'position is in degrees and velocity in rad/s; set [log.position] unit = "deg"',
    np.pi / 180: 'position is in rad and velocity in deg/s; set [log.velocity] unit = "deg/s"',
    np.pi / 30: 'position is in rad and velocity in rpm; set [log.velocity] unit = "rpm"',
    6.0: 'position is in degrees and velocity in rpm; set [log.position] unit = "deg" and [log.velocity] unit = "rpm"',
}
"""Slope of position versus integrated velocity -> the wrong units that cause it, and the settings that correct them."""


def check_plausible(log: RobotLog) -> list[str]:
    """Check a log of finite values, and describe each oddity in a sentence.

    Raises
    ------
    LogError
        If values are impossible: torques that are always zero, joints farther away than any robot moves, orientations
        that are not unit quaternions, velocities in another unit than positions.
    """
    where = log.path or "log"
    if not log.torque.any():
        raise LogError(f"{where}: 'torque' is zero in all samples of all joints; expected measured torques")
    _refuse_far(log, where)
    return [*_check_orientation(log, where), *_check_velocity_unit(log, where), *_note_wide_ranges(log)]


def _refuse_far(log: RobotLog, where: str) -> None:
    """Refuse positions and velocities beyond 1e8, where double precision does not resolve the motion of friction."""
    for name, channel in (("position", log.position), ("velocity", log.velocity)):
        if channel is not None and (largest := np.abs(channel).max(axis=0)).max() > 1e8:
            joint = int(np.argmax(largest))
            raise LogError(
                f"{where}: {name} of '{log.joint_names[joint]}' goes up to {largest[joint]:.3g}; expected at most 1e8 "
                f"in rad or m{'/s' * (name == 'velocity')}, set its unit by [log.{name}] unit"
            )


def _check_orientation(log: RobotLog, where: str) -> list[str]:
    quaternion = log.base_orientation
    if quaternion is None:
        return []
    norm = np.linalg.norm(quaternion, axis=1)
    row = int(np.argmax(np.abs(norm - 1)))
    if abs(norm[row] - 1) > 0.05:  # a unit quaternion rounded to two decimals is closer
        raise LogError(
            f"{where}: 'base_orientation' at {log.time[row]:.6g} s is {np.round(quaternion[row], 4).tolist()}, norm "
            f"{norm[row]:.4g}; expected a unit quaternion x, y, z, w"
        )
    x, y, z = quaternion.T[:3]
    upright, upright_if_wxyz = np.median(1 - 2 * (x**2 + y**2)), np.median(1 - 2 * (y**2 + z**2))
    if upright < 0.5 and upright_if_wxyz > 0.9:
        return ['The base orientation is upright only if its order is wxyz; set [log.base_orientation] order = "wxyz".']
    return []


def _check_velocity_unit(log: RobotLog, where: str) -> list[str]:
    """Compare the log's velocity with the slope of its position for each joint."""
    if log.velocity is None:
        return []
    slopes = np.array([position_slope(log, joint) for joint in range(len(log.joint_names))])
    slope = float(np.median(slopes[np.isfinite(slopes)])) if np.isfinite(slopes).any() else 1.0
    for ratio, meaning in RATIOS.items():
        if abs(slope / ratio - 1) < AGREEMENT:
            raise LogError(f"{where}: 'position' changes {slope:.4g} times as fast as 'velocity': probably {meaning}")
    turned = [name for name, slope in zip(log.joint_names, slopes, strict=True) if abs(slope + 1) < AGREEMENT]
    return [f"Position and velocity have opposite signs in {listed(turned)}."] if turned else []


def position_slope(log: RobotLog, joint: int) -> float:
    """Compute the ratio of position steps to integrated velocity; NaN if they do not match."""
    assert log.velocity is not None
    step = np.diff(log.time[:ROWS])
    moved = np.diff(log.position[:ROWS, joint])
    velocity: Array = log.velocity[:ROWS, joint]
    expected = (velocity[1:] + velocity[:-1]) / 2 * step
    power, both = float(expected @ expected), float(moved @ expected)
    if not both**2 > 0.9 * power * float(moved @ moved):  # squared correlation
        return np.nan
    return both / power


def _note_wide_ranges(log: RobotLog) -> list[str]:
    """Note joints that turn farther than joints with limits do."""
    span = np.ptp(log.position, axis=0)
    wide = [name for name, width in zip(log.joint_names, span, strict=True) if width > 8 * np.pi]
    if not wide:
        return []
    return [
        f"Positions of {listed(wide)} span more than four turns; if they are in degrees, set "
        '[log.position] unit = "deg".'
    ]
