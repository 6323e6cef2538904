"""Plausibility checks of a log's values, given their names and units."""

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.errors import LogError, listed
from stribeck.core.log import RobotLog
from stribeck.core.log.channels import ANGLE, SPEED

AGREEMENT = 0.05  # relative tolerance for the ratio of two units


def units_of_slope(slope: float) -> tuple[str, str] | None:
    """Find the units of position and velocity that make one change `slope` times as fast as the other shows.

    None if they agree, also in degrees or turns, or no units explain the slope.
    """
    speeds = [unit for unit in SPEED if not unit.startswith("m")]
    ratios = {(a, v): SPEED[v] / ANGLE[a] for a in ("rad", "deg", "turn") for v in speeds}
    nearest = min(ratios, key=lambda units: abs(np.log(max(slope, 1e-12) / ratios[units])))
    return nearest if ratios[nearest] != 1 and abs(slope / ratios[nearest] - 1) < AGREEMENT / 2 else None


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
    upright, upright_if_wxyz = uprightness(quaternion)
    if upright < 0.5 and upright_if_wxyz > 0.9:
        return ['The base orientation is upright only if its order is wxyz; set [log.base_orientation] order = "wxyz".']
    return []


def uprightness(quaternion: Array) -> tuple[float, float]:
    """Compute the median cosine of the base's tilt [1] from quaternions xyzw, and as if their order were wxyz.

    The tilt is that from the z axis of the world, or from the y axis, which motion capture often has as vertical.
    """
    x, y, z, w = quaternion.T
    upright = np.maximum(1 - 2 * (x**2 + y**2), 2 * (y * z - x * w))
    return float(np.nanmedian(upright)), float(np.nanmedian(1 - 2 * (y**2 + z**2)))


def _check_velocity_unit(log: RobotLog, where: str) -> list[str]:
    """Compare the log's velocity with the slope of its position for each joint."""
    if log.velocity is None:
        return []
    slopes = position_slopes(log)
    slope = float(np.nanmedian(slopes)) if np.isfinite(slopes).any() else 1.0
    if units := units_of_slope(slope):
        settings = dict(zip(("position", "velocity"), units, strict=True))
        wrong = [f'[log.{name}] unit = "{unit}"' for name, unit in settings.items() if not unit.startswith("rad")]
        raise LogError(
            f"{where}: 'position' changes {slope:.4g} times as fast as 'velocity': probably position is in "
            f"{units[0]} and velocity in {units[1]}; set {' and '.join(wrong)}"
        )
    turned = [name for name, slope in zip(log.joint_names, slopes, strict=True) if abs(slope + 1) < AGREEMENT]
    return [f"Position and velocity have opposite signs in {listed(turned)}."] if turned else []


def position_slopes(log: RobotLog) -> Array:
    """Compute the ratio of position steps to integrated velocity, shape (n,); NaN if they do not match."""
    assert log.velocity is not None
    rows = slice(50_000)  # sufficient to compare units
    velocity, moved = log.velocity[rows], np.diff(log.position[rows], axis=0)
    expected = (velocity[1:] + velocity[:-1]) / 2 * np.diff(log.time[rows])[:, None]
    power, both = np.sum(expected**2, axis=0), np.sum(moved * expected, axis=0)
    known = both**2 > 0.9 * power * np.sum(moved**2, axis=0)  # squared correlation
    return np.asarray(np.divide(both, power, out=np.full(len(both), np.nan), where=known))


def _note_wide_ranges(log: RobotLog) -> list[str]:
    """Note joints that turn farther than joints with limits do."""
    span = np.ptp(log.position, axis=0)
    wide = [name for name, width in zip(log.joint_names, span, strict=True) if width > 8 * np.pi]
    setting = '[log.position] unit = "deg"'
    return [f"Positions of {listed(wide)} span more than four turns; if in degrees, set {setting}."] if wide else []
