"""The dense equations of constrained motion, (5.4) to (5.13), one sample at a time.

They are the reference that the re-rooted recursion is tested and timed against. Positive friction torque resists
motion, so the paper's `tau_f` is `-R` and (5.13) reads `R = M_mod (a_est - a_msr)`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from stribeck.core.base.typing import Array
from stribeck.core.dynamics.root_motion import gravity_in_root_link
from stribeck.core.dynamics.state import State
from stribeck.core.robot import Robot
from stribeck.core.robot.rooting import RootedModel


@dataclass(frozen=True, eq=False)
class ConstrainedSample:
    """One sample of the constraint equation of motion, in the coordinates of the root link.

    Attributes
    ----------
    mobility
        `M_mod^-1 = S_tc M^-1 N S_tc^T` of (5.12), shape (k, k) for k torque-controlled joints.
    difference
        `S_tc (a_est - a_msr)`, shape (k,).
    multipliers
        Contact wrenches without friction, foot by foot in its own frame, then position-controlled torques (5.9).
    constraint_inertia
        `A = J_c M^-1 J_c^T` of (5.8), shape (m, m).
    friction_response
        `J_c M^-1 S_tc^T`, shape (m, k): effect of a friction torque on the constraints.
    """

    mobility: Array
    difference: Array
    multipliers: Array
    constraint_inertia: Array
    friction_response: Array


def constrained_sample(robot: Robot, feet: tuple[str, ...], state: State, torque: Array, k: int) -> ConstrainedSample:
    """Solve (5.4) to (5.12) at sample k of a floating robot.

    Parameters
    ----------
    robot
        Robot with a floating base.
    feet
        Standing contacts.
    state, torque
        Motion and joint torque, shape (T, n). Without an orientation the first foot is flat.
    k
        Index of the sample.
    """
    columns = robot.tree.columns
    motion = _equation_of_motion(robot, feet, state, torque, k)
    inverse = np.asarray(cho_solve(cho_factor(motion.inertia), np.eye(len(motion.inertia))))
    constraint = motion.constraint
    constraint_inertia = constraint @ inverse @ constraint.T  # (5.8)
    multipliers = np.linalg.solve(
        constraint_inertia, motion.right + constraint @ inverse @ (motion.bias - motion.effort)
    ).astype(float)  # (5.9)
    estimate = inverse @ (motion.effort - motion.bias + constraint.T @ multipliers)  # (5.10)
    projector = np.eye(len(inverse)) - constraint.T @ np.linalg.solve(constraint_inertia, constraint @ inverse)
    place = np.argsort(columns)[robot.torque_controlled] + 6  # robot order -> rows of the model
    estimated = np.empty(len(columns))
    estimated[columns] = estimate[6:]
    return ConstrainedSample(
        mobility=(inverse @ projector)[np.ix_(place, place)],
        difference=(estimated - state.acceleration[k])[robot.torque_controlled],
        multipliers=multipliers,
        constraint_inertia=constraint_inertia,
        friction_response=constraint @ inverse[:, place],
    )


class _Motion(NamedTuple):
    """`M a + bias = effort + J_c^T lambda` and `J_c a = right`, (5.5), in the order of the model."""

    inertia: Array
    bias: Array
    effort: Array
    constraint: Array
    right: Array


@cache
def _workspace(tree: RootedModel) -> tuple[pin.Model, pin.Data]:
    """Copy the model without gravity, which enters in root link coordinates, and allocate its working memory."""
    model = pin.Model(tree.model)
    model.gravity.linear = np.zeros(3)
    return model, model.createData()


def _equation_of_motion(robot: Robot, feet: tuple[str, ...], state: State, torque: Array, k: int) -> _Motion:
    model, data = _workspace(robot.tree)
    columns = robot.tree.columns
    configuration = pin.neutral(model)
    configuration[7:] = state.position[k, columns]
    pin.computeJointJacobians(model, data, configuration)
    pin.updateFramePlacements(model, data)
    jacobian = _contact_rows(robot, feet, model, partial(pin.getFrameJacobian, model, data))  # J of (5.4b)
    rates = np.concatenate([_base_rates(jacobian, state, k, columns), state.velocity[k, columns]])
    pin.forwardKinematics(model, data, configuration, rates, np.zeros(model.nv))
    drift = _contact_rows(  # J' v
        robot, feet, model, lambda *frame: pin.getFrameClassicalAcceleration(model, data, *frame).vector
    )
    inertia = pin.crba(model, data, configuration)
    inertia = np.triu(inertia) + np.triu(inertia, 1).T
    gravity = _gravity(robot, feet, state, k)
    controlled = np.flatnonzero(~np.isin(columns, robot.torque_controlled))
    selection = np.eye(model.nv)[6 + controlled]
    effort = np.concatenate([np.zeros(6), torque[k, columns]])
    effort[6 + controlled] = 0
    return _Motion(
        inertia=inertia,
        bias=pin.nonLinearEffects(model, data, configuration, rates) - inertia[:, :3] @ gravity,
        effort=effort,
        constraint=np.vstack([jacobian, selection]),  # (5.6), with the given motion instead of rest in its last rows
        right=np.concatenate([-drift, state.acceleration[k, columns[controlled]]]),
    )


def _base_rates(jacobian: Array, state: State, k: int, columns: NDArray[np.int64]) -> Array:
    """Compute the root link's velocity for feet at rest; the orientation determines rotations that feet leave free."""
    feet_rates = jacobian[:, 6:] @ state.velocity[k, columns]
    rates = np.linalg.lstsq(jacobian[:, :6], -feet_rates, rcond=None)[0]
    if state.orientation is not None and np.linalg.matrix_rank(jacobian[:, :6], tol=1e-9) < 6:
        rates[3:] = state.orientation.angular_velocity[k]
        rates[:3] = np.linalg.lstsq(jacobian[:, :3], -feet_rates - jacobian[:, 3:6] @ rates[3:], rcond=None)[0]
    return np.asarray(rates)


def _gravity(robot: Robot, feet: tuple[str, ...], state: State, k: int) -> Array:
    """Compute gravity in root link coordinates [m/s^2], shape (3,)."""
    if state.orientation is not None:
        return np.asarray(gravity_in_root_link(state.orientation.quaternion[k : k + 1], robot.gravity)[0])
    rotation, _ = robot.foot_pose(feet[0], state.position[k : k + 1])
    return np.asarray(rotation[0] @ robot.gravity)


def _contact_rows(
    robot: Robot, feet: tuple[str, ...], model: pin.Model, rows_of: Callable[[int, pin.ReferenceFrame], Array]
) -> Array:
    """Concatenate the constrained rows of all feet, each in the frame of its foot."""
    contacts = [robot.contacts[foot] for foot in feet]
    local = pin.ReferenceFrame.LOCAL
    return np.concatenate([rows_of(model.getFrameId(each.frame), local)[: each.size] for each in contacts])


def dense_friction_torque(robot: Robot, feet: tuple[str, ...], state: State, torque: Array) -> tuple[Array, Array]:
    """Compute the friction torque (5.13) of the torque-controlled joints and the wrenches on the standing feet.

    Returns
    -------
    friction_torque
        Shape (T, n), NaN for position-controlled joints.
    wrench
        Ground reaction on each standing foot in its own frame, shape (T, m).
    """
    friction = np.full(torque.shape, np.nan)
    wrench = np.empty((len(torque), sum(robot.contacts[foot].size for foot in feet)))
    for k in range(len(torque)):
        sample = constrained_sample(robot, feet, state, torque, k)
        found = np.linalg.solve(sample.mobility, sample.difference)
        friction[k, robot.torque_controlled] = found
        change = np.linalg.solve(sample.constraint_inertia, sample.friction_response @ found)
        wrench[k] = (sample.multipliers + change)[: wrench.shape[1]]
    return friction, wrench
