"""Standing feet from foot forces: check sign and unit, then apply a threshold with hysteresis."""

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.dynamics.contact.phases import Segments, Standing, switch, up_in_base
from stribeck.core.errors import LogError, SettingsError
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.core.settings import SupportSettings


def standing_from_forces(log: RobotLog, robot: Robot, segments: Segments, settings: SupportSettings) -> Standing:
    """Find standing feet, and feet that touch the ground without standing, from their loads.

    A foot lands when its load rises above `force_on` times the robot's weight, and lifts when its load falls below
    `force_off` times the weight. A foot with a load in between that has not landed touches: it neither stands nor
    swings freely. Neither does one that something pulls by `force_on` times the weight.

    Raises
    ------
    SettingsError
        If `force_off` is above `force_on`.
    LogError
        If the log has no foot forces, or they have a wrong sign or unit.
    """
    if settings.force_off > settings.force_on:
        raise SettingsError(
            f"[identify.support] force_off is {settings.force_off:g}; "
            f"expected at most force_on, which is {settings.force_on:g}"
        )
    weight = robot.mass * float(np.linalg.norm(robot.gravity))
    loads = foot_loads(log, robot)
    notes = _check_total(log, loads[np.concatenate([np.r_[s] for s in segments])].sum(axis=1), weight)
    standing = np.zeros(loads.shape, dtype=bool)
    for segment in segments:
        standing[segment] = switch(loads[segment], settings.force_on * weight, settings.force_off * weight)
    pulled = loads < -settings.force_on * weight
    return standing, ~standing & (pulled | (loads > settings.force_off * weight)), notes


def force_channel(log: RobotLog) -> str | None:
    """Return the name of the channel with the feet's loads; None if the log has none."""
    return next((name for name in ("foot_wrench", "foot_force") if getattr(log, name) is not None), None)


def foot_loads(log: RobotLog, robot: Robot) -> Array:
    """Compute the load of each foot [N], shape (T, feet), positive when the ground pushes.

    The load of a surface is the force along its normal, the z axis of the contact frame. A point foot rotates with its
    shank, so the vertical part of its force is used; sensors with a single axis and `foot_force` are used without
    rotation.

    Raises
    ------
    LogError
        If the log has no foot forces.
    """
    wrench, force = log.foot_wrench, log.foot_force
    if wrench is None and force is None:
        raise LogError(
            f"{log.path or 'log'}: [identify.support] source is 'forces', but the log has no channel foot_wrench or "
            "foot_force"
        )
    if wrench is None:
        return np.asarray(force)[:, [log.foot_names.index(foot) for foot in robot.contacts]]
    loads = np.empty((len(log.time), len(robot.contacts)))
    for k, foot in enumerate(robot.contacts):
        force = wrench[:, log.foot_names.index(foot), :3]
        if robot.contacts[foot].kind != "surface" and np.any(force[:, :2]):
            rotation, _ = robot.foot_pose(foot, log.position)
            loads[:, k] = np.einsum("ti,tij,tj->t", up_in_base(log, robot), rotation, force)
        else:
            loads[:, k] = force[:, 2]
    return loads


def _check_total(log: RobotLog, total: Array, weight: float) -> list[str]:
    """Compare the load of all feet with the weight: note a difference, refuse a wrong sign or unit."""
    # Relative difference of foot load and robot weight above which a note is added [1].
    tolerance = 0.25
    size = np.abs(total)
    carried = total[size > 0.3 * np.percentile(size, 95)]  # [1]; below, the feet are off the ground
    share = float(np.median(carried)) / weight if len(carried) else 0.0
    units = {1 / 9.81: ("kgf", 9.81), 1e-3: ("kN", 1000.0), 1e3: ("mN", 0.001)}  # load divided by weight -> unit
    unit = next((unit for ratio, unit in units.items() if abs(abs(share) / ratio - 1) < tolerance), None)
    name, channel = log.path or "log", force_channel(log)
    if unit is not None:
        raise LogError(
            f"{name}: the forces in {channel} add up to {abs(share) * weight:.4g}, but the weight is {weight:.4g} N: "
            f"their unit is probably {unit[0]}; set [log] {channel} = {{scale = {np.sign(share) * unit[1]:g}}}"
        )
    if share < -tolerance:
        raise LogError(
            f"{name}: the forces in {channel} add up to {share * weight:.4g} N while the robot stands, but forces "
            f"of the ground on a foot point up along z; set [log] {channel} = {{scale = -1.0}}"
        )
    if abs(share - 1) > tolerance:
        return [
            f"The feet carry a median of {share * weight:.4g} N, but the model weighs {weight:.4g} N: "
            "a foot may be missing, or the model's mass may be wrong."
        ]
    return []
