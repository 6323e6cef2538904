"""Checks that a log's numbers are what their names and units say."""

import numpy as np

from stribeck.base.typing import Array
from stribeck.errors import LogError
from stribeck.log import RobotLog
from stribeck.log.readers.recording import listed

ROWS = 50_000  # looked at where units are compared
AGREEMENT = 0.05  # relative; how closely a ratio must meet that of two units
RATIOS = {
    180 / np.pi: "position is in degrees and velocity in rad/s",
    np.pi / 180: "position is in rad and velocity in deg/s",
    np.pi / 30: "position is in rad and velocity in rpm",
    6.0: "position is in degrees and velocity in rpm",
}
"""Slope of the position over the integral of the velocity, where their units do not belong together."""


def check_plausible(log: RobotLog) -> list[str]:
    """Return a sentence for each thing that looks odd in a log of finite values.

    Raises
    ------
    LogError
        Where numbers cannot be meant: torques that are zero throughout, joints further away than any robot moves,
        orientations that are no unit quaternions, velocities in another unit than positions.
    """
    where = log.path or "log"
    if not log.torque.any():
        raise LogError(f"{where}: 'torque' is zero at every sample of every joint; expected the torques of the joints")
    _refuse_far(log, where)
    return [*_orientation(log, where), *_velocity_unit(log, where), *_wide(log)]


def _refuse_far(log: RobotLog, where: str) -> None:
    """Refuse positions and velocities beyond 1e8, of which float64 does not resolve the steps that friction needs."""
    for name, channel in (("position", log.position), ("velocity", log.velocity)):
        if channel is not None and (largest := np.abs(channel).max(axis=0)).max() > 1e8:
            joint = int(np.argmax(largest))
            raise LogError(
                f"{where}: {name} of '{log.joint_names[joint]}' goes up to {largest[joint]:.3g}; expected at most 1e8 "
                f"in rad or m{'/s' * (name == 'velocity')}, set its unit by [log.{name}] unit"
            )


def _orientation(log: RobotLog, where: str) -> list[str]:
    quaternion = log.base_orientation
    if quaternion is None:
        return []
    norm = np.linalg.norm(quaternion, axis=1)
    row = int(np.argmax(np.abs(norm - 1)))
    if abs(norm[row] - 1) > 0.05:  # a unit quaternion rounded to two decimals is closer
        raise LogError(
            f"{where}: 'base_orientation' at {log.time[row]:.6g} s is {np.round(quaternion[row], 4).tolist()}, of norm "
            f"{norm[row]:.4g}; expected a unit quaternion x, y, z, w"
        )
    x, y, z = quaternion.T[:3]
    upright, upright_if_wxyz = np.median(1 - 2 * (x**2 + y**2)), np.median(1 - 2 * (y**2 + z**2))
    if upright < 0.5 and upright_if_wxyz > 0.9:
        return [
            "The base orientation would be upright if its order were wxyz, and is not as xyzw: "
            'see [log.base_orientation] order = "wxyz".'
        ]
    return []


def _velocity_unit(log: RobotLog, where: str) -> list[str]:
    """Compare the log's velocity with the slope of its position, joint by joint."""
    if log.velocity is None:
        return []
    slopes = np.array([position_slope(log, joint) for joint in range(len(log.joint_names))])
    slope = float(np.median(slopes[np.isfinite(slopes)])) if np.isfinite(slopes).any() else 1.0
    for ratio, meaning in RATIOS.items():
        if abs(slope / ratio - 1) < AGREEMENT:
            raise LogError(
                f"{where}: 'position' changes {slope:.4g} times as fast as 'velocity' says, as if {meaning}; "
                "expected one unit, set by [log.position] unit and [log.velocity] unit"
            )
    turned = [name for name, slope in zip(log.joint_names, slopes, strict=True) if abs(slope + 1) < AGREEMENT]
    return [f"Position and velocity have opposite signs in {listed(turned)}."] if turned else []


def position_slope(log: RobotLog, joint: int) -> float:
    """Return the factor between steps of the position and the integral of the velocity, NaN where they do not match."""
    assert log.velocity is not None
    step = np.diff(log.time[:ROWS])
    moved = np.diff(log.position[:ROWS, joint])
    velocity: Array = log.velocity[:ROWS, joint]
    expected = (velocity[1:] + velocity[:-1]) / 2 * step
    power, both = float(expected @ expected), float(moved @ expected)
    if not both**2 > 0.9 * power * float(moved @ moved):  # squared cosine between them
        return np.nan
    return both / power


def _wide(log: RobotLog) -> list[str]:
    """Return a note on joints that turn further than joints with limits do."""
    span = np.ptp(log.position, axis=0)
    wide = [name for name, width in zip(log.joint_names, span, strict=True) if width > 8 * np.pi]
    if not wide:
        return []
    return [
        f"Positions of {listed(wide)} span more than four turns: right for wheels, but if they are degrees, set "
        '[log.position] unit = "deg".'
    ]
