"""Batched inverse dynamics of a rooted tree: one O(n) recursion a sample, in Pinocchio's compiled, parallel code.

Gravity is felt as an upward acceleration of the root, so one model serves every tilt: all quantities of a floating root
are in its own coordinates, and the world does not appear.
"""

import os
from dataclasses import dataclass
from functools import cache

import numpy as np
import pinocchio as pin

from stribeck.base.typing import Array
from stribeck.robot.rooting import RootedModel

THREADS = os.cpu_count() or 1


@dataclass(frozen=True, eq=False)
class RootMotion:
    """How the root of a floating tree moves, in its own coordinates.

    Attributes
    ----------
    gravity
        [m/s^2], shape (T, 3).
    velocity
        Linear [m/s], then angular [rad/s], shape (T, 6); None at rest.
    acceleration
        Time derivative of `velocity` in the moving frame (Pinocchio's spatial acceleration), shape (T, 6);
        None at rest.
    """

    gravity: Array
    velocity: Array | None = None
    acceleration: Array | None = None


@cache
def _pool(rooted: RootedModel) -> pin.ModelPool:
    """Return the pool of working memories for a tree; in it a floating tree feels no gravity of its own."""
    model = pin.Model(rooted.model)
    if rooted.floating:
        model.gravity.linear = np.zeros(3)
    return pin.ModelPool(model, THREADS)


def rooted_inverse_dynamics(
    rooted: RootedModel, position: Array, velocity: Array, acceleration: Array, root: RootMotion | None = None
) -> tuple[Array, Array]:
    """Return the wrench on the root and the joint torques that a motion needs.

    Parameters
    ----------
    rooted
        The tree.
    position, velocity, acceleration
        Of the robot's joints, in the robot's order, shape (T, n).
    root
        Motion of a floating root; None for a fixed one.

    Returns
    -------
    wrench
        Force [N] and moment [N m] on the root body at the root frame, in its coordinates, shape (T, 6);
        shape (T, 0) for a fixed root. With the root a standing foot it is the ground reaction.
    torque
        [N m], shape (T, n), in the robot's order.
    """
    samples, joints = position.shape
    size = rooted.root_size
    columns = rooted.columns
    model = rooted.model
    configuration = np.empty((samples, model.nq))
    rates = np.empty((2, samples, model.nv))
    if size:
        configuration[:, :7] = (0, 0, 0, 0, 0, 0, 1)
        rates[:, :, :size] = 0
        if root is not None:
            rates[1, :, :3] = -root.gravity
            if root.velocity is not None:
                rates[0, :, :size] = root.velocity
            if root.acceleration is not None:
                rates[1, :, :size] += root.acceleration
    configuration[:, model.nq - joints :] = position[:, columns]
    rates[0, :, size:] = velocity[:, columns]
    rates[1, :, size:] = acceleration[:, columns]
    effort = np.empty((samples, model.nv))
    if samples:
        threads = THREADS if samples >= 4096 else 1  # fewer take as long as threads wait for one another
        pin.rneaInParallel(threads, _pool(rooted), configuration.T, rates[0].T, rates[1].T, effort.T)
    torque = np.empty((samples, joints))
    torque[:, columns] = effort[:, size:]
    return effort[:, :size], torque


def joint_inertia(rooted: RootedModel, position: Array) -> Array:
    """Return the joint-space inertia matrix of the rooted tree, shape (T, n, n), in the robot's order.

    With the root a standing foot this is the paper's `M_mod` of (5.13).
    """
    size = rooted.root_size
    return inertia_matrix(rooted, position)[:, size:, size:]


def inertia_matrix(rooted: RootedModel, position: Array) -> Array:
    """Return the inertia matrix of the rooted tree, a floating root first, then the joints in the robot's order.

    Shape (T, r + n, r + n) with r = 6 for a floating root, in its own coordinates, and 0 for a fixed one. Pinocchio has
    no batched call for it.
    """
    model, size, columns = rooted.model, rooted.root_size, rooted.columns
    data = model.createData()
    configuration = np.tile(pin.neutral(model), (len(position), 1))
    configuration[:, model.nq - len(columns) :] = position[:, columns]
    matrix = np.empty((len(position), model.nv, model.nv))
    for k, row in enumerate(configuration):
        matrix[k] = pin.crba(model, data, row)
    order = np.concatenate([np.arange(size), size + np.argsort(columns)])  # of the model's joints by the robot's
    return np.asarray(matrix[:, order[:, None], order])
