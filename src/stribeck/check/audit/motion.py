"""Direction of gravity and speed of the clock, estimated from the torques of all joints together."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from stribeck.check.audit.evidence import AuditData
from stribeck.check.audit.regression import FEWEST, effective_share, fit, friction_shapes, without
from stribeck.core.base.finding import Finding, Setting, rounded
from stribeck.core.base.typing import Array
from stribeck.core.dynamics.loops import without_loop_forces
from stribeck.core.dynamics.root_motion import gravity_in_root_link
from stribeck.core.dynamics.rooted import RootMotion, rooted_inverse_dynamics
from stribeck.core.dynamics.state import root_quaternions
from stribeck.core.robot import Robot
from stribeck.core.robot.kinematics import direction_in_root
from stribeck.core.robot.rooting import BASE_FRAME

SURE = 5.0
"""Deviation of an inertial part from its expected value that counts as significant [standard errors]."""


@dataclass(frozen=True, eq=False)
class _Pooled:
    """Fit of all joints: `torque = gravity terms . gravity + inertial * inertial terms + friction`.

    Attributes
    ----------
    gravity, gravity_error
        Estimated gravity [m/s^2], shape (3,), and its largest standard error.
    inertial, inertial_error
        Factor of the terms of velocities and accelerations [1], and its standard error.
    share
        Share of the torques without friction that the fit explains [1].
    residual
        Weighted residual squares, relative to a fit with the given gravity direction and a free gain per joint [1].
    dissipation
        Mean over the joints with friction of the dissipation in `Fit`, from -1 to 1.
    """

    gravity: Array
    gravity_error: float
    inertial: float
    inertial_error: float
    share: float
    residual: float
    dissipation: float


def check_motion(evidence: AuditData) -> list[Finding]:
    """Report gravity in another direction, or time at another speed."""
    if len(evidence.rows) < FEWEST:
        return []
    clock = _velocity_clock(evidence)
    if clock:
        return clock
    pooled = _pooled(evidence)
    if pooled is None or pooled.share < 0.7:
        return []
    given = evidence.robot.gravity
    size, normal = float(np.linalg.norm(pooled.gravity)), float(np.linalg.norm(given))
    if not 0.5 < size / max(normal, 1e-9) < 1.6 or pooled.gravity_error > 0.08 * normal:
        return []
    turned = angle_between(pooled.gravity, given)
    forward = pooled.inertial > SURE * pooled.inertial_error or (
        abs(pooled.inertial) < SURE * pooled.inertial_error and pooled.dissipation > 0.3
    )
    reported = np.deg2rad(45.0)  # smallest angle between the given and the estimated gravity [rad]
    if turned > reported:
        return [_turned(pooled, turned, normal)] if forward and pooled.residual < 0.5 else []
    if turned > reported / 2 or len(evidence.rows) < 125:  # model errors dominate the inertia of few bins
        return []
    if evidence.prepared.log.velocity is not None:  # it agrees with the slope of the position: so does the clock
        return []
    ratio = pooled.inertial * normal / size
    error = pooled.inertial_error * normal / size
    scale = 1 / np.sqrt(max(ratio, 1e-9))  # of time: accelerations are proportional to its inverse square
    sure = abs(ratio - 1) > SURE * error and error < 0.2 * ratio and pooled.residual < 0.7
    if sure and 1.6 < max(scale, 1 / scale) < 2.5:
        return [_clock_finding(evidence, scale, "the inertial part of the torques relative to gravity")]
    return []


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
    velocity = log.velocity[evidence.rows][:, evidence.robot.torque_controlled]
    ratios = []
    for k in range(velocity.shape[1]):
        slope, logged = evidence.velocity[:, k], velocity[:, k]
        both, power = float(slope @ logged), float(logged @ logged)
        if evidence.moves(k) and power and both**2 > 0.9 * power * float(slope @ slope):
            ratios.append(both / power)
    ratio = float(np.median(ratios)) if ratios else 1.0
    if not (1.8 < ratio < 2.2 or 0.45 < ratio < 0.55) or np.mean(np.abs(np.array(ratios) / ratio - 1) < 0.1) < 0.75:
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


def _turned(pooled: _Pooled, turned: float, size: float) -> Finding:
    """Report gravity in another direction: along an axis, if one is within 20 degrees."""
    direction = pooled.gravity / np.linalg.norm(pooled.gravity)
    axis = int(np.argmax(np.abs(direction)))
    if abs(direction[axis]) > np.cos(np.deg2rad(20)):
        direction = np.sign(direction[axis]) * np.eye(3)[axis]
    return Finding.of(
        "gravity",
        turned="upside down" if turned > np.deg2rad(150) else f"turned by {np.rad2deg(turned):.0f}°",
        direction=np.round(pooled.gravity, 1).tolist(),
        left=100 * pooled.residual,
        settings=[_gravity_setting(size * direction)],
    )


def _pooled(evidence: AuditData) -> _Pooled | None:
    given = evidence.robot.gravity
    gravity = gravity_torques(evidence, evidence.robot, np.eye(3))
    matrix, vector = np.zeros((4, 4)), np.zeros(4)
    before = after_gains = squares = 0.0
    independent: list[float] = []
    used = []
    for k in range(len(evidence.joints)):
        rows = np.isfinite(evidence.model[:, k]) & np.all(np.isfinite(gravity[:, k]), axis=1)
        if rows.sum() < FEWEST:
            continue
        inertial = evidence.model[rows, k] - gravity[rows, k] @ given
        columns, torque = without(
            friction_shapes(evidence, k, rows), np.column_stack([gravity[rows, k], inertial]), evidence.torque[rows, k]
        )
        model = columns @ np.append(given, 1.0)
        free = torque - columns @ np.linalg.lstsq(columns, torque, rcond=None)[0]
        variance = max(float(free @ free) / max(1, len(free) - 8), 1e-4 * float(torque @ torque) / len(free), 1e-30)
        gain = float(model @ torque) / max(float(model @ model), 1e-30)
        matrix += columns.T @ columns / variance
        vector += columns.T @ torque / variance
        squares += float(torque @ torque) / variance
        after_gains += float(np.sum((torque - gain * model) ** 2)) / variance
        independent.append(effective_share(free, free, evidence.run[rows]))
        before += len(free)
        used.append(k)
    if not used or np.linalg.cond(matrix) > 1e12:
        return None
    solution = np.linalg.solve(matrix, vector)
    residual = squares - float(vector @ solution)
    scale = max(1.0, residual / before) / float(np.mean(independent))
    errors = np.sqrt(np.diag(np.linalg.inv(matrix)) * scale)
    torques = gravity @ solution[:3] + solution[3] * (evidence.model - gravity @ given)
    return _Pooled(
        gravity=np.asarray(solution[:3]),
        gravity_error=float(errors[:3].max()),
        inertial=float(solution[3]),
        inertial_error=float(errors[3]),
        share=1 - residual / max(squares, 1e-30),
        residual=residual / max(after_gains, 1e-30),
        dissipation=_dissipation(evidence, used, torques),
    )


def _dissipation(evidence: AuditData, joints: Sequence[int], model: Array) -> float:
    """Average the dissipation of joints with friction, given the torques of a model, shape (B, k)."""
    fits = [fit(evidence, k, model=model[:, k]) for k in joints]
    dissipations = [result.dissipation for result in fits if result is not None and result.friction > result.residual]
    return float(np.mean(dissipations)) if dissipations else 0.0


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
    turned = None
    if robot.base == "floating" and log.base_orientation is not None:
        turned = root_quaternions(robot, position, log.base_orientation[evidence.rows])
    for k, name in enumerate(evidence.support_names):
        rows = np.flatnonzero(evidence.support == k)
        if not len(rows):
            continue
        feet = [foot for foot in name.split("+") if foot in robot.contacts]
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
