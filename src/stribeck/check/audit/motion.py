"""Direction of gravity and speed of the clock: the cause that explains the torques of all joints best."""

from dataclasses import replace

import numpy as np
import pinocchio as pin

from stribeck.check.audit.evidence import LEAST_BINS, AuditData
from stribeck.check.audit.regression import BETTER, POOR, all_unexplained, friction_shapes, misfit, winner, without
from stribeck.core.base.finding import Finding, Setting, rounded
from stribeck.core.base.typing import Array
from stribeck.core.dynamics.loops import without_loop_forces
from stribeck.core.dynamics.root_motion import gravity_in_root_link
from stribeck.core.dynamics.rooted import RootMotion, rooted_inverse_dynamics
from stribeck.core.dynamics.state import root_quaternions
from stribeck.core.robot import Robot
from stribeck.core.robot.kinematics import direction_in_root
from stribeck.core.robot.rooting import BASE_FRAME


def check_motion(evidence: AuditData) -> list[Finding]:
    """Report gravity in another direction, torques without gravity, or time at another speed.

    Each cause changes the model's torques, and the causes compete by what remains unexplained; friction keeps its sign.
    """
    if len(evidence.rows) < LEAST_BINS:
        return []
    if clock := _velocity_clock(evidence):
        return clock
    given = evidence.robot.gravity
    of_gravity = gravity_torques(evidence, evidence.robot, np.eye(3))
    inertial = evidence.model - of_gravity @ given
    fitted = _fitted_gravity(evidence, of_gravity, inertial)
    angle = float(np.rad2deg(angle_between(fitted, given)))
    gravities = {"gravity.none": np.zeros(3)} | ({"gravity": fitted} if angle > 45 else {})
    models = {"": evidence.model} | {check: of_gravity @ gravity + inertial for check, gravity in gravities.items()}
    scales, fewest = {"slow": 2.0, "fast": 0.5}, 125  # of time, squared in accelerations; errors dominate fewer bins
    if evidence.prepared.log.velocity is None and len(evidence.rows) >= fewest:
        models |= {speed: of_gravity @ given + inertial / scale**2 for speed, scale in scales.items()}
    shares = {cause: all_unexplained(replace(evidence, model=model)) for cause, model in models.items()}
    costs = {cause: misfit(left) for cause, left in shares.items()}
    best = winner(costs, BETTER)
    if not best or not np.nanmedian(shares[best]) <= POOR:
        return []
    if best in scales:
        others = np.argsort(shares[best] / shares[""])[1:]  # a clock concerns not only the joint that gains most
        if len(others) and misfit(shares[best][others]) > misfit(shares[""][others]) - np.log(2):
            return []
        return [_clock_finding(evidence, scales[best], "the inertial part of the torques")]
    left, turned = np.exp((costs[best] - costs[""]) / len(shares[""])), f"turned by {angle:.0f}°"
    turned = "upside down" if angle > 150 else turned
    return [Finding.of(best, turned=turned, left=100 * left, settings=[_gravity_setting(gravities[best])])]


def _fitted_gravity(evidence: AuditData, of_gravity: Array, inertial: Array) -> Array:
    """Fit gravity to all torques, shape (3,): an axis if one is within 10 degrees, zeros if its size differs.

    The torques are those of unit gravity along each axis [kg m], (B, k, 3), and of motion [N m], (B, k).
    """
    parts, size = [np.zeros((1, 4))], float(np.linalg.norm(evidence.robot.gravity))
    for k in range(len(evidence.joints)):
        rows = np.isfinite(inertial[:, k])
        if rows.sum() >= LEAST_BINS:
            torques = np.column_stack([of_gravity[rows, k], evidence.torque[rows, k] - inertial[rows, k]])
            (loads,) = without(friction_shapes(evidence, k, rows), torques)
            error = loads[:, 3] - loads[:, :3] @ np.linalg.lstsq(loads[:, :3], loads[:, 3], rcond=None)[0]
            parts.append(loads / max(float(np.linalg.norm(error)), 0.01 * float(np.linalg.norm(loads[:, 3])), 1e-12))
    loads = np.concatenate(parts)
    gravity = np.asarray(np.linalg.lstsq(loads[:, :3], loads[:, 3], rcond=1e-6)[0])
    fitted = float(np.linalg.norm(gravity))
    if not 0.5 * size < fitted < 1.6 * size:
        return np.zeros(3)
    axis = np.round(gravity / fitted)
    near = gravity @ axis > np.cos(np.deg2rad(10)) * fitted and np.abs(axis).sum() == 1
    return np.asarray(size * (axis if near else gravity / fitted))


def _clock_finding(evidence: AuditData, scale: float, how: str) -> Finding:
    """Report that time must be multiplied by about two or a half."""
    table, exact = evidence.robot.log_table, 2.0 if scale > 1 else 0.5
    present = table.time.scale if isinstance(table.time.scale, float | int) else 1.0
    setting = Setting("log.time", "scale", present * exact)
    if table.rate is not None:
        setting = Setting("log", "rate", table.rate / exact)
    speed = "slowly" if scale > 1 else "fast"
    return Finding.of("clock", factor=max(scale, 1 / scale), speed=speed, evidence=how, settings=[setting])


def _velocity_clock(evidence: AuditData) -> list[Finding]:
    """Compare the log's velocity with the slope of its position."""
    log = evidence.prepared.log
    if log.velocity is None:
        return []
    slope, logged = evidence.velocity, log.velocity[evidence.rows][:, evidence.robot.torque_controlled]
    both, power = np.sum(slope * logged, axis=0), np.sum(logged**2, axis=0)
    agree = (evidence.top_speed > 0.01) & (power > 0) & (both**2 > 0.9 * power * np.sum(slope**2, axis=0))
    ratios = both[agree] / power[agree]
    ratio = float(np.median(ratios)) if agree.any() else 1.0
    if not (1.8 < ratio < 2.2 or 0.45 < ratio < 0.55) or np.mean(np.abs(ratios / ratio - 1) < 0.1) < 0.75:
        return []
    return [_clock_finding(evidence, ratio, "the slope of the position relative to the velocity")]


def angle_between(vector: Array, other: Array) -> float:
    """Compute the angle between two vectors [rad]."""
    return float(np.arctan2(np.linalg.norm(np.cross(vector, other)), vector @ other))


def tilted(evidence: AuditData, gravity: Array) -> Finding:
    """Report a base that is tilted: gravity [m/s^2] has another direction than the given one."""
    given = evidence.robot.gravity
    direction = np.linalg.norm(given) * gravity / np.linalg.norm(gravity)
    angle = np.rad2deg(angle_between(gravity, given))
    return Finding.of("gravity.tilted", angle=angle, stops=False, settings=[_gravity_setting(direction)])


def _gravity_setting(gravity: Array) -> Setting:
    return Setting("robot", "gravity", [rounded(value, 4) for value in np.round(gravity, 3) + 0.0])


def gravity_torques(evidence: AuditData, robot: Robot, directions: Array) -> Array:
    """Compute a robot's torques at rest in the postures of the bins.

    Parameters
    ----------
    robot
        The evidence's robot, or one with other inertias.
    directions
        Gravity [m/s^2], shape (D, 3).

    Returns
    -------
    torque
        Torques [N m], shape (B, k, D).
    """
    log = evidence.prepared.log
    position = log.position[evidence.rows]
    still, torques = np.zeros_like(position), np.full((*evidence.model.shape, len(directions)), np.nan)
    attitude = log.base_orientation if robot.base == "floating" else None
    turned = None if attitude is None else root_quaternions(robot, position, attitude[evidence.rows])
    for k, feet in enumerate(evidence.support_feet):
        rows = np.flatnonzero(evidence.support == k)
        if not len(rows):
            continue
        sole = next((foot for foot in feet if robot.contacts[foot].kind == "surface"), None)
        tree = robot.rooted_at(sole) if sole else robot.tree
        for axis, gravity in enumerate(directions):
            motion = None
            if robot.base == "fixed":
                model = pin.Model(robot.tree.model)
                model.gravity.linear = gravity
                tree = replace(robot.tree, model=model)
            elif turned is None:
                motion = RootMotion(np.broadcast_to(gravity, (len(rows), 3)))
            else:
                pull = gravity_in_root_link(turned[rows], gravity)
                if sole:
                    pull = direction_in_root(tree, tree.model.getFrameId(BASE_FRAME), position[rows], pull)
                motion = RootMotion(pull)
            torque = rooted_inverse_dynamics(tree, position[rows], still[rows], still[rows], motion)[1]
            torques[rows, :, axis] = without_loop_forces(robot, position[rows], torque)[:, robot.torque_controlled]
    return torques
