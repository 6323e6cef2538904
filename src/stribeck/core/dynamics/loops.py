"""Closed kinematic loops: positions of the passive joints, and dynamics in the independent joints.

The joints are split into independent and passive ones, q = (q_i, q_p). A loop requires gap(q) = 0, so

    J_p v_p = -J_i v_i,  v = G v_i,  G = (1, -J_p^+ J_i),        a = G a_i + (0, -J_p^+ J' v)

The loop forces do no work in any such motion, G^T J^T = 0. Multiplying the tree's equation of motion by G^T therefore
removes them: embedding, R. Featherstone, Rigid Body Dynamics Algorithms, 2008, section 8.5. No torque acts on passive
joints; their friction appears at the independent joints, as G^T maps it.
"""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array
from stribeck.core.dynamics.rooted import workspace
from stribeck.core.errors import LogError, RobotFileError
from stribeck.core.log.robot_log import RobotLog
from stribeck.core.robot import Robot

RANK, ROUNDED = 1e-6, 1e-3
"""Relative tolerances of singular values [1]: of redundant constraints or a dead center, and of rounded axes."""


@dataclass(frozen=True, eq=False)
class LoopTerms:
    """Gaps [m], [rad], shape (T, m), their Jacobian J, shape (T, m, n), and J' v, shape (T, m), in the root's axes."""

    gap: Array
    jacobian: Array
    drift: Array


def loop_terms(robot: Robot, position: Array, velocity: Array | None = None) -> LoopTerms:
    """Compute gap, Jacobian and drift (zero without velocities) of all loops.

    Pinocchio has no batched call for them.
    """
    model, data = workspace(robot.tree)
    columns, size = robot.tree.columns, robot.tree.root_size
    frames = [[model.getFrameId(name) for name in loop.frames] for loop in robot.loops]
    rows = sum(loop.size for loop in robot.loops)
    gap, drift = np.empty((2, len(position), rows))
    jacobian = np.empty((len(position), rows, len(columns)))
    configuration, rates, still = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
    for k, row in enumerate(position):
        configuration[model.nq - len(columns) :] = row[columns]
        if velocity is not None:
            rates[size:] = velocity[k, columns]
            pin.forwardKinematics(model, data, configuration, rates, still)
        pin.computeJointJacobians(model, data, configuration)
        pin.updateFramePlacements(model, data)
        first = 0
        for loop, (end, other) in zip(robot.loops, frames, strict=True):
            block, count = slice(first, first + loop.size), loop.size
            first += count
            poses = data.oMf[end], data.oMf[other]
            gap[k, block][:3] = poses[0].translation - poses[1].translation
            if count == 6:
                gap[k, block][3:] = pin.log3(poses[0].rotation @ poses[1].rotation.T)
            both = [pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED) for frame in (end, other)]
            jacobian[k, block][:, columns] = (both[0] - both[1])[:count, size:]
            if velocity is not None:
                turns = [
                    pin.getFrameClassicalAcceleration(model, data, frame, pin.LOCAL_WORLD_ALIGNED).vector
                    for frame in (end, other)
                ]
                drift[k, block] = (turns[0] - turns[1])[:count]
    return LoopTerms(gap, jacobian, drift if velocity is not None else np.zeros_like(gap))


def passive_response(robot: Robot, jacobian: Array) -> Array:
    """Compute -J_p^+ J_i, the ratio of passive to independent velocities, shape (T, passive, independent)."""
    inverse = np.linalg.pinv(jacobian[:, :, robot.passive_columns], rcond=RANK)
    return np.asarray(-inverse @ jacobian[:, :, robot.independent])


def without_loop_forces(robot: Robot, position: Array, torque: Array) -> Array:
    """Apply G^T to joint torques, shape (T, n) or (T, n, c), to remove loop forces; passive columns become zero.

    Without loops, torques are unchanged.
    """
    if not robot.loops:
        return torque
    response = passive_response(robot, loop_terms(robot, position).jacobian)
    projection = np.zeros(torque.shape)
    passive = torque[:, robot.passive_columns]
    projection[:, robot.independent] = torque[:, robot.independent] + np.einsum("tpi,tp...->ti...", response, passive)
    return projection


def closed_log(log: RobotLog, robot: Robot) -> tuple[RobotLog, list[str]]:
    """Add missing (NaN) positions, velocities and accelerations of passive joints to a log.

    Raises
    ------
    RobotFileError
        If the loops leave passive joints free.
    LogError
        If the loops cannot be closed at the positions of the logged joints.
    """
    if not robot.loops:
        return log, []
    passive, position = robot.passive_columns, log.position
    torque = log.torque.copy()
    torque[:, passive] = 0.0
    missing = [robot.joint_names[k] for k in passive if not np.isfinite(position[:, k]).any()]
    if missing:
        position = _solve_passive(robot, log)
    known = np.isfinite(position).all(axis=1)
    if not known.any():
        return log, []
    some = position[known][:: max(1, len(position) // 200)]
    terms = loop_terms(robot, some)
    free = ", ".join(robot.joint_names[k] for k in passive)
    if np.linalg.matrix_rank(terms.jacobian[0][:, passive], rtol=RANK) < len(passive):
        raise RobotFileError(
            f"{robot.path}: [[robot.loops]] do not determine the motion of {free}; expected as many passive "
            "joints as the loops constrain, away from a dead center"
        )
    if np.linalg.matrix_rank(terms.jacobian[0], rtol=ROUNDED) > len(passive):
        raise RobotFileError(
            f"{robot.path}: [[robot.loops]] constrain more joints than the passive joints {free}, so that the others "
            "do not move freely; expected every joint of the loops without a motor in [robot] passive"
        )
    velocity, acceleration = _add_rates(robot, position, log.velocity, log.acceleration)
    widest = 1e3 * float(np.abs(terms.gap).max())
    note = f"Gaps of the closed loops are up to {widest:.2g} mm or mrad."
    if missing:
        note = f"Positions of the passive joints {', '.join(missing)} were computed from the loops. {note}"
    taken = "Friction of passive joints cannot be separated from friction of the joints that move them, and adds to it."
    log = replace(log, position=position, torque=torque, velocity=velocity, acceleration=acceleration)
    return log, [note, taken]


def _add_rates(
    robot: Robot, position: Array, velocity: Array | None, acceleration: Array | None
) -> tuple[Array | None, Array | None]:
    """Compute velocities and accelerations of passive joints from the other joints, unless they are logged."""
    passive = robot.passive_columns
    if velocity is None or np.isfinite(velocity[:, passive]).any():
        return velocity, acceleration
    position, velocity = np.nan_to_num(position), velocity.copy()  # rows with missing values are removed later
    jacobian = loop_terms(robot, position).jacobian
    response = passive_response(robot, jacobian)
    velocity[:, passive] = np.einsum("tpi,ti->tp", response, velocity[:, robot.independent])
    if acceleration is not None:
        drift = loop_terms(robot, position, velocity).drift
        inverse = np.linalg.pinv(jacobian[:, :, passive], rcond=RANK)
        acceleration = acceleration.copy()
        acceleration[:, passive] = np.einsum("tpi,ti->tp", response, acceleration[:, robot.independent])
        acceleration[:, passive] -= np.einsum("tpm,tm->tp", inverse, drift)
    return velocity, acceleration


def _solve_passive(robot: Robot, log: RobotLog) -> Array:
    """Solve for the positions of the passive joints, sample by sample, starting from the model's zero."""
    # Largest step of independent joints [rad], [m] between two solutions; larger ones may reach another branch.
    stride = 0.05
    independent = robot.independent
    position = log.position.copy()
    position[:, robot.passive_columns] = np.nan
    now = np.zeros(position.shape[1])
    for k in np.flatnonzero(np.isfinite(position[:, independent]).all(axis=1)).tolist():
        step = position[k, independent] - now[independent]
        parts = max(1, int(np.ceil(np.abs(step).max() / stride)))
        before = now[independent].copy()
        for part in range(1, parts + 1):
            now[independent] = before + step * part / parts
            gap = _close(robot, now)
            if not gap < 1e-3:  # [m], [rad]; digits of a model explain smaller gaps
                loops, size = ", ".join(map(str, robot.loops)), f"{1e3 * gap:.3g} mm or mrad"
                raise LogError(
                    f"{log.path or 'log'}: at {log.time[k]:.3f} s the loops of {loops} cannot be closed: {size} "
                    "remain; check zeros and signs of the logged joints, and the model"
                )
        position[k] = now
    return position


def _close(robot: Robot, position: Array) -> float:
    """Move the passive joints of one sample, in place, by Gauss-Newton until the loops close; return the gap."""
    closed = 1e-12  # [m], [rad]; gap or step below which the iteration ends
    passive, gap = robot.passive_columns, np.inf
    for _ in range(30):  # three are usual
        terms = loop_terms(robot, position[None])
        gap = float(np.abs(terms.gap).max())
        step = np.linalg.lstsq(terms.jacobian[0][:, passive], terms.gap[0], rcond=RANK)[0]
        if not gap >= closed or np.abs(step).max() < closed:
            break
        position[passive] -= step
    return gap
