"""Batched inverse dynamics of a rooted tree: one O(n) recursion per sample, in Pinocchio's compiled, parallel code.

Gravity enters as an upward acceleration of the root, so that one model serves every tilt: all quantities of a floating
root are in its own coordinates, independent of the world.
"""

import os
from dataclasses import dataclass
from functools import cache

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array
from stribeck.core.robot.rooting import RootedModel

THREADS = os.cpu_count() or 1

MASSLESS = 1e-6
"""Relative joint inertia [1] below which a joint has no independent acceleration."""


@dataclass(frozen=True, eq=False)
class RootMotion:
    """Motion of the root of a floating tree, in the root's coordinates.

    Attributes
    ----------
    gravity
        Gravity [m/s^2], shape (T, 3).
    velocity
        Linear [m/s], then angular velocity [rad/s], shape (T, 6); None at rest.
    acceleration
        Time derivative of `velocity` in the moving frame (Pinocchio's spatial acceleration), shape (T, 6); None at
        rest.
    """

    gravity: Array
    velocity: Array | None = None
    acceleration: Array | None = None


@cache
def workspace(rooted: RootedModel) -> tuple[pin.Model, pin.Data]:
    """Return a tree's model and its working memory; gravity enters a floating tree as the root's acceleration."""
    model = pin.Model(rooted.model)
    if rooted.floating:
        model.gravity.linear = np.zeros(3)
    return model, model.createData()


@cache
def _pool(rooted: RootedModel) -> pin.ModelPool:
    return pin.ModelPool(workspace(rooted)[0], THREADS)


def model_motion(
    rooted: RootedModel, position: Array, velocity: Array, acceleration: Array, root: RootMotion | None
) -> tuple[Array, Array, Array]:
    """Assemble configuration, velocity and acceleration in Pinocchio's order; the root's acceleration has gravity."""
    samples, size, model = len(position), rooted.root_size, rooted.model
    configuration, rates = np.tile(pin.neutral(model), (samples, 1)), np.zeros((2, samples, model.nv))
    configuration[:, model.nq - len(rooted.columns) :] = position[:, rooted.columns]
    rates[:, :, size:] = velocity[:, rooted.columns], acceleration[:, rooted.columns]
    if size and root is not None:
        rates[1, :, :3] = -root.gravity
        if root.velocity is not None:
            rates[0, :, :size] = root.velocity
        if root.acceleration is not None:
            rates[1, :, :size] += root.acceleration
    return configuration, rates[0], rates[1]


def rooted_inverse_dynamics(
    rooted: RootedModel, position: Array, velocity: Array, acceleration: Array, root: RootMotion | None = None
) -> tuple[Array, Array]:
    """Compute the wrench on the root and the joint torques of a motion.

    Parameters
    ----------
    rooted
        Rooted tree.
    position, velocity, acceleration
        Motion of the joints in robot order, shape (T, n).
    root
        Motion of a floating root; None for a fixed root.

    Returns
    -------
    wrench
        Force [N] and moment [N m] on the root body at the root frame, in its coordinates, shape (T, 6); shape (T, 0)
        for a fixed root. If the root is a standing foot, this is the ground reaction.
    torque
        Joint torques [N m], shape (T, n), in robot order.
    """
    motion = model_motion(rooted, position, velocity, acceleration, root)
    effort = np.empty((len(position), rooted.model.nv))
    if len(position):
        threads = THREADS if len(position) >= 4096 else 1  # shorter batches are faster without threads
        pin.rneaInParallel(threads, _pool(rooted), *(coordinates.T for coordinates in motion), effort.T)
    torque = np.empty(position.shape)
    torque[:, rooted.columns] = effort[:, rooted.root_size :]
    return effort[:, : rooted.root_size], torque


def joint_inertia(rooted: RootedModel, position: Array) -> Array:
    """Compute the joint-space inertia matrix of the rooted tree, shape (T, n, n), in robot order.

    If the root is a standing foot, this is the paper's `M_mod` of (5.13).
    """
    size = rooted.root_size
    return inertia_matrix(rooted, position)[:, size:, size:]


def inertia_matrix(rooted: RootedModel, position: Array) -> Array:
    """Compute the inertia matrix of the rooted tree: first a floating root, then the joints in robot order.

    Shape (T, r + n, r + n) with r = 6 for a floating root, in its own coordinates, and 0 for a fixed one. Pinocchio has
    no batched call for it.
    """
    (model, data), columns = workspace(rooted), rooted.columns
    configuration = np.tile(pin.neutral(model), (len(position), 1))
    configuration[:, model.nq - len(columns) :] = position[:, columns]
    matrix = np.empty((len(position), model.nv, model.nv))
    for k, row in enumerate(configuration):
        matrix[k] = pin.crba(model, data, row)
    return np.asarray(matrix[:, rooted.order[:, None], rooted.order])
