"""What torques say of gravity's direction and of the clock, by all joints together."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from stribeck.audit.evidence import Evidence
from stribeck.audit.regression import FEWEST, effective_share, fit, friction_shapes
from stribeck.dynamics.loops import without_loop_forces
from stribeck.dynamics.root_motion import gravity_in_root_link
from stribeck.dynamics.rooted import RootMotion, rooted_inverse_dynamics
from stribeck.dynamics.state import root_quaternions
from stribeck.finding import Finding
from stribeck.robot.kinematics import direction_in_root
from stribeck.robot.rooting import BASE_FRAME
from stribeck.typing import Array

EXPLAINED = 0.7
"""Share of what friction leaves of the torques that the fit must explain."""
WORSE = 0.5
"""What it leaves, over what gravity as given leaves where each joint has a gain of its own."""
WORSE_IN_TIME = 0.7
"""The same of a clock."""
SURE = 5.0
"""Standard errors."""
BINS_FOR_CLOCK = 125
"""In less the inertial parts are too small a part of too few motions to be told from the model's errors."""
TURNED = np.deg2rad(45.0)
"""[rad] between gravity as given and as found."""
CLOCK = (1.6, 2.5)
"""Factors of the clock that count as two."""


@dataclass(frozen=True, eq=False)
class _Pooled:
    """`torque = gravity terms . gravity + inertial * inertial terms + friction`, one fit to all joints.

    Attributes
    ----------
    gravity, gravity_error
        [m/s^2], shape (3,), and its largest standard error.
    inertial, inertial_error
        Of the terms of velocities and accelerations [1].
    share
        That the fit explains of what friction leaves.
    left
        Weighted squares that it leaves, over those that gains of each joint's own leave with gravity as given.
    dissipation
        From -1 to 1, as in `Fit`, of the joints in which there is friction.
    """

    gravity: Array
    gravity_error: float
    inertial: float
    inertial_error: float
    share: float
    left: float
    dissipation: float


def check_motion(evidence: Evidence) -> list[Finding]:
    """Return a finding if gravity points elsewhere, or time runs at another speed."""
    clock = _velocity_clock(evidence)
    if clock:
        return clock
    pooled = _pooled(evidence)
    if pooled is None or pooled.share < EXPLAINED:
        return []
    given = evidence.robot.gravity
    size, normal = float(np.linalg.norm(pooled.gravity)), float(np.linalg.norm(given))
    if not 0.5 < size / max(normal, 1e-9) < 1.6 or pooled.gravity_error > 0.08 * normal:
        return []
    turned = float(np.arccos(np.clip(pooled.gravity @ given / size / normal, -1, 1)))
    forward = pooled.inertial > SURE * pooled.inertial_error or (
        abs(pooled.inertial) < SURE * pooled.inertial_error and pooled.dissipation > 0.3
    )
    if turned > TURNED:
        return _turned(evidence, pooled, turned) if forward and pooled.left < WORSE else []
    if turned > TURNED / 2 or len(evidence.rows) < BINS_FOR_CLOCK:
        return []
    ratio = pooled.inertial * normal / size
    error = pooled.inertial_error * normal / size
    scale = 1 / np.sqrt(max(ratio, 1e-9))  # of time: accelerations go with its square
    sure = abs(ratio - 1) > SURE * error and error < 0.2 * ratio and pooled.left < WORSE_IN_TIME
    if sure and CLOCK[0] < max(scale, 1 / scale) < CLOCK[1]:
        return [_clock_finding(evidence, scale, "the torques' inertial parts against those of gravity")]
    return []


def _clock_finding(evidence: Evidence, scale: float, how: str) -> Finding:
    """Return the finding that time must be multiplied by about two or a half."""
    table, exact = evidence.robot.log_table, 2.0 if scale > 1 else 0.5
    present = table.time.scale if isinstance(table.time.scale, float | int) else 1.0
    cure = f"[log.time] scale = {present * exact:.4g}"
    if table.rate is not None:
        cure = f"[log] rate = {table.rate / exact:.6g}"
    return Finding(
        check="clock",
        text=f"the clock runs {max(scale, 1 / scale):.2f} times too {'slowly' if scale > 1 else 'fast'}, by {how}",
        cure=f"set {cure}",
        stops=True,
    )


def _velocity_clock(evidence: Evidence) -> list[Finding]:
    """Compare the log's own velocity with the slope of its position."""
    log = evidence.prepared.log
    if log.velocity is None or len(evidence.rows) < FEWEST:
        return []
    own = log.velocity[evidence.rows][:, evidence.robot.torque_controlled]
    ratios = []
    for k in range(own.shape[1]):
        slope, logged = evidence.velocity[:, k], own[:, k]
        both, power = float(slope @ logged), float(logged @ logged)
        if evidence.moves(k) and power and both**2 > 0.9 * power * float(slope @ slope):
            ratios.append(both / power)
    if not ratios:
        return []
    ratio = float(np.median(ratios))
    agree = np.mean(np.abs(np.array(ratios) / ratio - 1) < 0.1)
    if agree < 0.75 or not (1.8 < ratio < 2.2 or 0.45 < ratio < 0.55):
        return []
    return [_clock_finding(evidence, ratio, "the slope of the position against the velocity")]


def _turned(evidence: Evidence, pooled: _Pooled, turned: float) -> list[Finding]:
    size = float(np.linalg.norm(evidence.robot.gravity))
    direction = pooled.gravity / np.linalg.norm(pooled.gravity)
    axis = int(np.argmax(np.abs(direction)))
    if abs(direction[axis]) > np.cos(np.deg2rad(20)):
        direction = np.sign(direction[axis]) * np.eye(3)[axis]
    shown = ", ".join(f"{value:.4g}" for value in np.round(size * direction, 3) + 0.0)
    where = "upside down" if turned > np.deg2rad(150) else f"turned by {np.rad2deg(turned):.0f} deg"
    return [
        Finding(
            check="gravity",
            text=f"gravity is {where}: torques fit {np.round(pooled.gravity, 1).tolist()} m/s^2, which leaves "
            f"{100 * pooled.left:.0f} % of the variance that the given one leaves with a gain for each joint",
            cure=f"set [robot] gravity = [{shown}], or mend the model's or the IMU's axes",
            stops=True,
        )
    ]


def _pooled(evidence: Evidence) -> _Pooled | None:
    gravity = gravity_torques(evidence)
    matrix, vector = np.zeros((4, 4)), np.zeros(4)
    before = after_gains = squares = 0.0
    independent: list[float] = []
    power = size = 0.0
    used = []
    for k in range(len(evidence.joints)):
        rows = np.isfinite(evidence.model[:, k]) & np.all(np.isfinite(gravity[:, k]), axis=1)
        if rows.sum() < FEWEST:
            continue
        shapes = friction_shapes(evidence, k, rows)
        basis = np.linalg.qr(shapes / np.maximum(np.linalg.norm(shapes, axis=0), 1e-12))[0]
        terms = gravity[rows, k]
        inertial = evidence.model[rows, k] - terms @ evidence.robot.gravity
        columns = np.column_stack([terms, inertial])
        columns = columns - basis @ (basis.T @ columns)
        torque = evidence.torque[rows, k] - basis @ (basis.T @ evidence.torque[rows, k])
        model = columns @ np.append(evidence.robot.gravity, 1.0)
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
    found = np.linalg.solve(matrix, vector)
    left = squares - float(vector @ found)
    scale = max(1.0, left / before) / float(np.mean(independent))
    errors = np.sqrt(np.diag(np.linalg.inv(matrix)) * scale)
    for k in used:
        other = gravity[:, k] @ found[:3] + found[3] * (evidence.model[:, k] - gravity[:, k] @ evidence.robot.gravity)
        one = fit(evidence, k, model=other)
        if one is not None and one.friction > one.residual:
            power, size = power + one.dissipation, size + 1
    return _Pooled(
        gravity=np.asarray(found[:3]),
        gravity_error=float(errors[:3].max()),
        inertial=float(found[3]),
        inertial_error=float(errors[3]),
        share=1 - left / max(squares, 1e-30),
        left=left / max(after_gains, 1e-30),
        dissipation=power / size if size else 0.0,
    )


def gravity_torques(evidence: Evidence) -> Array:
    """Return the torques that hold the robot against gravity of 1 m/s^2 along each axis, shape (B, k, 3)."""
    robot, log = evidence.robot, evidence.prepared.log
    position = log.position[evidence.rows]
    known = robot.torque_controlled
    found = np.full((len(position), len(known), 3), np.nan)
    if robot.base == "fixed":
        model = pin.Model(robot.tree.model)
        data = model.createData()
        configuration = np.tile(pin.neutral(model), (len(position), 1))
        configuration[:, model.nq - position.shape[1] :] = position[:, robot.tree.columns]
        for axis in range(3):
            model.gravity.linear = np.eye(3)[axis]
            needed = np.array([pin.computeGeneralizedGravity(model, data, q) for q in configuration])
            torque = np.empty(position.shape)
            torque[:, robot.tree.columns] = needed.reshape(len(position), -1)
            found[:, :, axis] = torque[:, known]
        return found
    turned = None
    if log.base_orientation is not None:
        turned = root_quaternions(robot, position, log.base_orientation[evidence.rows])
    for k, name in enumerate(evidence.support_names):
        rows = np.flatnonzero(evidence.support == k)
        feet = [foot for foot in name.split("+") if foot in robot.contacts]
        sole = next((foot for foot in feet if robot.contacts[foot].kind == "surface"), None)
        rooted = robot.rooted_at(sole) if sole else robot.tree
        for axis in range(3):
            direction = np.broadcast_to(np.eye(3)[axis], (len(rows), 3))
            if turned is not None:
                direction = gravity_in_root_link(turned[rows], np.eye(3)[axis])
                if sole:
                    frame = rooted.model.getFrameId(BASE_FRAME)
                    direction = direction_in_root(rooted, frame, position[rows], direction)
            still = np.zeros(position[rows].shape)
            _, torque = rooted_inverse_dynamics(rooted, position[rows], still, still, RootMotion(direction))
            found[rows, :, axis] = without_loop_forces(robot, position[rows], torque)[:, known]
    found[~np.isfinite(evidence.model)] = np.nan
    return found
