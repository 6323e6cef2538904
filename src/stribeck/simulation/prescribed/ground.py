"""Ground reactions on a floating robot in a prescribed motion, and the remaining joint torques."""

import os

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from stribeck.core.base.typing import Array
from stribeck.core.robot import Robot
from stribeck.simulation.prescribed.limb import BodyMotion, Leg, end_motion


def inverse_dynamics(robot: Robot, joints: Array, base: BodyMotion | None) -> tuple[Array, Array]:
    """Compute the torques of a motion by one recursion from the root link, with gravity in the world frame.

    Returns
    -------
    wrench
        Force and moment on the root link at its origin, in world coordinates, shape (T, 6); zero for a fixed base.
    torque
        Joint torques without friction and ground reactions [N m], shape (T, n).
    """
    model = pin.Model(robot.tree.model)
    model.gravity.linear = robot.gravity
    columns, samples = robot.tree.columns, joints.shape[1]
    configuration, rates, changes = joints[:, :, columns]
    if base is not None:
        quaternion = Rotation.from_matrix(base.rotation).as_quat()
        velocity, acceleration = spatial_motion(base)
        configuration = np.hstack([base.position, quaternion, configuration])
        rates, changes = np.hstack([velocity, rates]), np.hstack([acceleration, changes])
    threads = os.cpu_count() or 1
    effort = np.empty((samples, model.nv))
    pool = pin.ModelPool(model, threads)
    contiguous = (np.ascontiguousarray(array) for array in (configuration, rates, changes))
    pin.rneaInParallel(threads, pool, *(array.T for array in contiguous), effort.T)
    torque = np.empty((samples, len(columns)))
    torque[:, columns] = effort[:, robot.tree.root_size :]
    wrench = np.zeros((samples, 6))
    if base is not None:
        wrench = _turn(base.rotation, effort[:, :6])
    return wrench, torque


def spatial_motion(base: BodyMotion) -> tuple[Array, Array]:
    """Compute the base's velocity and its derivative in the moving base, linear then angular, shape (T, 6) each."""
    back = base.rotation.transpose(0, 2, 1)
    velocity, acceleration = _turn(back, base.velocity), _turn(back, base.acceleration)
    acceleration[:, :3] -= np.cross(velocity[:, 3:], velocity[:, :3])
    return velocity, acceleration


def ground_reactions(
    legs: tuple[Leg, ...],
    joints: Array,
    base: BodyMotion,
    wrench: Array,
    share: Array,
    standing: NDArray[np.bool_],
) -> tuple[Array, Array]:
    """Distribute the base's wrench among the standing feet, and compute its effect on the joints.

    Of all ground reactions W that carry the base, `A W = wrench`, this is the smallest in the norm `W^T D^-1 W`, where
    D contains the load weights of the feet: `W = D A^T (A D A^T)^+ wrench`.

    Parameters
    ----------
    legs
        Legs with feet.
    joints, base
        Motion at T samples.
    wrench
        Required wrench on the root link at its origin, in world coordinates, shape (T, 6).
    share
        Load weight of each foot, shape (T, feet).
    standing
        Mask of standing feet, shape (T, feet).

    Returns
    -------
    reactions
        Force and moment of the ground on each foot, in the contact frame, shape (T, feet, 6).
    effect
        Joint torques `J^T W` [N m], shape (T, n).
    """
    samples = len(wrench)
    ends, jacobians = [], []
    maps, weights = np.zeros((samples, 6, 6 * len(legs))), np.zeros((samples, 6 * len(legs)))
    for k, leg in enumerate(legs):
        end, jacobian = end_motion(leg.limb, base, joints[:, :, leg.limb.columns])
        ends.append(end)
        jacobians.append(jacobian)
        arm = end.position - base.position
        block = maps[:, :, 6 * k : 6 * k + 6]
        block[:] = np.eye(6)
        block[:, 3:, :3] = np.cross(arm[:, None, :], np.eye(3)).transpose(0, 2, 1)
        size = leg.contact.size
        # standing feet have a minimum weight, so that the feet can always carry the base
        load = np.where(standing[:, k], np.maximum(share[:, k], 1e-6), 0.0)
        # a moment costs as much as a force with a lever of 0.1 m
        weights[:, 6 * k : 6 * k + size] = load[:, None] * np.array([1.0] * 3 + [0.1**2] * 3)[:size]
    spread = weights[:, :, None] * maps.transpose(0, 2, 1)
    # rcond: the standing feet carry no wrench in directions below this relative size
    multipliers = np.linalg.pinv(maps @ spread, rcond=1e-11, hermitian=True) @ wrench[:, :, None]
    carried = (spread @ multipliers)[:, :, 0].reshape(samples, len(legs), 6)
    effect = np.zeros_like(joints[0])
    reactions = np.empty_like(carried)
    for k, leg in enumerate(legs):
        effect[:, leg.limb.columns] += np.einsum("tik,ti->tk", jacobians[k], carried[:, k])
        reactions[:, k] = _turn(ends[k].rotation.transpose(0, 2, 1), carried[:, k])
    return reactions, effect


def _turn(rotation: Array, vectors: Array) -> Array:
    """Rotate pairs of vectors, shape (T, 6), sample by sample."""
    return np.hstack([(rotation @ half[:, :, None])[:, :, 0] for half in (vectors[:, :3], vectors[:, 3:])])
