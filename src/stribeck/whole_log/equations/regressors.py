"""Regressors Y of the corrections (docs/estimator.md, "Regressors"; Atkeson, An and Hollerbach 1986).

All are taken at the windows' centres, of the smoothed motion: corrections are small, so that this costs no accuracy.
"""

from collections.abc import Callable
from functools import cache

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.dynamics.rooted import RootMotion
from stribeck.dynamics.state import Orientation, State
from stribeck.robot import Robot
from stribeck.robot.inertial_parameters import SIZE, carried
from stribeck.robot.rooting import RootedModel

TURN = 1e-5
"""Step of the differences [rad] or [m]: rounding and curvature both stay below a part in ten thousand."""


@cache
def _workspace(rooted: RootedModel) -> tuple[pin.Model, pin.Data]:
    model = pin.Model(rooted.model)
    if rooted.floating:
        model.gravity.linear = np.zeros(3)  # it enters as the root's acceleration
    return model, model.createData()


def inertia_regressors(
    robot: Robot, rooted: RootedModel, rows: NDArray[np.int64], state: State, root: RootMotion | None
) -> Array:
    """Return the derivatives of inverse dynamics by the bodies' inertial parameters, shape (K, rows, 10 bodies).

    Rows are counted as `inertia_matrix` orders them: those of a floating root first, then the robot's joints.

    The bodies are those of `robot.tree`, each with its parameters in its own joint's frame, whatever foot stands: a
    body that is passed the other way has moved into another frame, which its parameters follow linearly.
    """
    model, data = _workspace(rooted)
    places, moves = _bodies_in(rooted, robot.tree)
    order, motion = _order(rooted)[rows], _motion(rooted, model, state, root)
    found = np.empty((len(state.position), len(rows), len(places), SIZE))
    for k, each in enumerate(zip(*motion, strict=True)):  # Pinocchio has no batched call for it
        regressor = pin.computeJointTorqueRegressor(model, data, *each)
        found[k] = regressor.reshape(model.nv, -1, SIZE)[order[:, None], places]
    for body, move in moves.items():
        found[:, :, body] = found[:, :, body] @ move
    return found.reshape(*found.shape[:2], -1)


@cache
def _bodies_in(rooted: RootedModel, tree: RootedModel) -> tuple[NDArray[np.int64], dict[int, Array]]:
    """Return where the bodies of the robot's own tree are in another, and what their parameters become there.

    Only those that are passed the other way, between the roots of both, have moved into another frame.
    """
    if rooted is tree:
        return np.arange(tree.model.njoints - 1), {}
    homes = [rooted.bodies[body] for body in range(1, tree.model.njoints)]
    moves = {k: carried(pose.homogeneous) for k, (_, pose) in enumerate(homes) if not pose.isIdentity()}
    return np.array([joint - 1 for joint, _ in homes]), moves


def zero_regressors(
    rooted: RootedModel, rows: NDArray[np.int64], state: State, root_of: Callable[[State], RootMotion | None]
) -> Array:
    """Return minus the rows' derivatives by joint positions, then by the tilt, shape (K, rows, all joints + 3).

    Rows are counted as `inertia_matrix` orders them.

    They are the effect of encoder zeros, and of the tilt of an IMU (none on a fixed base, or where the foot is taken to
    be level).
    """
    model, data = _workspace(rooted)
    count, windows, size = state.position.shape[1], len(state.position), rooted.root_size
    order, motion = _order(rooted)[rows], _motion(rooted, model, state, root_of(state))
    columns = np.zeros((windows, len(rows), count + 3))
    by_root = np.empty((windows, len(rows), 2 * size))
    for k, each in enumerate(zip(*motion, strict=True)):  # Pinocchio has no batched call for it
        by_position, by_velocity, inertia = pin.computeRNEADerivatives(model, data, *each)
        columns[k, :, :count] = -by_position[order][:, _order(rooted)[size:]]
        by_root[k] = np.hstack([by_velocity[order, :size], inertia[order, :size]])
    if size:  # which moves and is tilted as the joints and the base have it
        moved = _moved(state)
        roots = np.hstack(_root_rates(root_of(moved), len(moved.position))).reshape(-1, windows, 2 * size)
        change = (roots[1:] - roots[:1]).transpose(1, 2, 0) / TURN
        columns[:, :, : change.shape[2]] -= by_root @ change
    return columns


def _order(rooted: RootedModel) -> NDArray[np.int64]:
    """Return the place in Pinocchio's vectors of a floating root and of the robot's joints, as rows are counted."""
    size = rooted.root_size
    return np.concatenate([np.arange(size), size + np.argsort(rooted.columns)])


def _motion(rooted: RootedModel, model: pin.Model, state: State, root: RootMotion | None) -> tuple[Array, Array, Array]:
    """Return configurations, velocities and accelerations in Pinocchio's order, gravity in the root's acceleration."""
    columns, samples = rooted.columns, len(state.position)
    configuration = np.tile(pin.neutral(model), (samples, 1))
    configuration[:, model.nq - len(columns) :] = state.position[:, columns]
    of_root = _root_rates(root, samples)
    of_joints = state.velocity[:, columns], state.acceleration[:, columns]
    velocity, acceleration = (np.hstack(parts) for parts in zip(of_root, of_joints, strict=True))
    return configuration, velocity, acceleration


def _root_rates(root: RootMotion | None, samples: int) -> tuple[Array, Array]:
    """Return velocity and acceleration of a root, gravity in it, shape (samples, 6) each; (samples, 0) of none."""
    if root is None:
        return np.zeros((samples, 0)), np.zeros((samples, 0))
    velocity, acceleration = np.zeros((2, samples, 6))
    if root.velocity is not None:
        velocity += root.velocity
    if root.acceleration is not None:
        acceleration += root.acceleration
    acceleration[:, :3] -= root.gravity
    return velocity, acceleration


def _moved(state: State) -> State:
    """Return the state as it is, then with each joint moved, then with the root link turned about each of its axes."""
    windows, count = state.position.shape
    copies = 1 + count + (0 if state.orientation is None else 3)
    position = np.tile(state.position, (copies, 1)).reshape(copies, windows, count)
    position[1 + np.arange(count), :, np.arange(count)] += TURN
    turn = state.orientation
    if turn is not None:
        quaternion = np.tile(turn.quaternion, (copies, 1)).reshape(copies, windows, 4)
        for axis in range(3):
            half = 0.5 * TURN * np.eye(3)[axis]  # quaternion of a small turn, its scalar one
            vector, scalar = turn.quaternion[:, :3], turn.quaternion[:, 3:]
            quaternion[1 + count + axis, :, :3] += scalar * half + np.cross(vector, half)
            quaternion[1 + count + axis, :, 3] -= vector @ half
        still = np.zeros((copies * windows, 3))
        turn = Orientation(quaternion.reshape(-1, 4), still, still)
    return State(
        position.reshape(-1, count),
        np.tile(state.velocity, (copies, 1)),
        np.tile(state.acceleration, (copies, 1)),
        turn,
    )
