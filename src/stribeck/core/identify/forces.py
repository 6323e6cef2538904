"""Causes of disturbances on a fixed base: a force on one link, or an error of one joint's torque.

A force F at a point of a link acts on the joints before it by J^T F. Its point is constant in the link. If the
force is free at every instant, as of a hand or a table, it explains any torques of three joints. It is considered only
if more joints are disturbed, and otherwise a force that is constant in the world.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.estimator.fit_checks.payloads import EXPLAINED, Residual
from stribeck.core.robot.rooting import RootedModel

Link = tuple[Array, Array, Array, Array]
"""Linear and angular Jacobian of a joint's origin, shape (K, 3, n) each; rotation of its link, (K, 3, 3); its tip."""


@dataclass(frozen=True)
class Force:
    """A force on the link after a joint, or an error of the joint's torque if `size` is None.

    Attributes
    ----------
    joint
        Number of the joint in the equations.
    size
        Median size of the force [N].
    """

    joint: int
    size: float | None


def find_force(tree: RootedModel, columns: IntArray, position: Array, residual: Residual) -> Force | None:
    """Find the joint or link whose error or force explains a span; None if none does, or more than two links do.

    A point on the axis of a joint may belong to both of its links: to the first one within this link's extent.

    Parameters
    ----------
    tree
        Robot on a fixed base, whose joints with equations are `columns`.
    position
        Positions of all joints at the windows [rad], shape (K, all joints).
    residual
        Residual of the span.
    """
    rows = slice(None, None, 1 + len(position) // 100)  # at most 100 windows are fitted
    weight, position = residual.weight[rows], position[rows]
    remainder = residual.torque[rows] * weight
    if len(remainder) < 10:  # too few windows to distinguish causes
        return None
    shares = np.sum(remainder**2, axis=0) / np.sum(remainder**2)
    alone = 1 - shares.max()  # share of chi^2 that an error of a single torque leaves [1]
    links = _links(tree, columns, position)
    disturbed = np.count_nonzero(shares > 0.01)  # joints with at least 1 % of chi^2
    for constant in (True, False) if disturbed > 3 else (True,):
        rests, sizes, reaches = np.array([_point_force(weight, remainder, link, constant) for link in links]).T
        most = max(1.5 * rests.min(), 1e-3)
        if alone < min(1 - EXPLAINED, most):
            return Force(int(shares.argmax()), None)
        alike = np.flatnonzero(rests <= most)  # links that explain the span about equally well
        if rests.min() < 1 - EXPLAINED and len(alike) <= 2:
            joint = next((k for k in alike.tolist() if reaches[k] < 1.1), int(alike[-1]))  # within the link's extent
            return Force(joint, float(sizes[joint]))
    return None


def _links(tree: RootedModel, columns: IntArray, position: Array) -> list[Link]:
    """Compute Jacobians, rotations and tips of the joints' links at some positions."""
    model, data = tree.model, tree.model.createData()
    places = np.argsort(tree.columns)[columns]
    joints, shape = (1 + places).tolist(), (len(columns), len(position))
    jacobians, turns = np.empty((*shape, 6, len(columns))), np.empty((*shape, 3, 3))
    for row, posture in enumerate(position):
        pin.computeJointJacobians(model, data, posture[tree.columns])
        for k, joint in enumerate(joints):
            jacobian = pin.getJointJacobian(model, data, joint, pin.LOCAL_WORLD_ALIGNED)
            jacobians[k, row] = jacobian.reshape(6, -1)[:, places]  # that of a single joint is a vector
            turns[k, row] = data.oMi[joint].rotation
    return [
        (jacobian[:, :3], jacobian[:, 3:], turn, _tip(model, joint))
        for joint, jacobian, turn in zip(joints, jacobians, turns, strict=True)
    ]


def _tip(model: pin.Model, joint: int) -> Array:
    """Find the point of a link that is farthest from its joint: the origin of a frame or of the next joint [m]."""
    ends = [frame.placement.translation for frame in model.frames if frame.parentJoint == joint]
    ends += [model.jointPlacements[child].translation for child in model.children[joint]]
    return np.asarray(max(ends, key=lambda end: float(np.linalg.norm(end))))


def _point_force(weight: Array, remainder: Array, link: Link, constant: bool) -> tuple[float, float, float]:
    """Fit the point of a force: the share of chi^2 that it leaves [1], its median size [N], and the point's distance.

    The distance from the joint is relative to the distance of the link's tip [1]. The search starts at
    the joint, halfway to the tip, and at the tip.
    """
    from scipy.optimize import least_squares

    linear, angular, turn, tip = link

    def fitted(point: Array) -> tuple[Array, Array]:
        lever = np.einsum("kij,j->ki", turn, point)
        moved = linear + np.cross(angular, lever[:, :, None], axis=1)
        effect = weight[:, :, None] * moved.transpose(0, 2, 1)
        if constant:
            force = np.broadcast_to(np.linalg.lstsq(effect.reshape(-1, 3), remainder.ravel())[0], (len(remainder), 3))
        else:
            force = np.einsum("kij,kj->ki", np.linalg.pinv(effect, rcond=1e-3), remainder)
        return remainder - np.einsum("kij,kj->ki", effect, force), force

    def residual(point: Array) -> Array:
        return fitted(point)[0].ravel()

    fits = [least_squares(residual, start, max_nfev=15) for start in (0.0 * tip, 0.5 * tip, tip)]
    fits = [fit for fit in fits if np.linalg.norm(fit.x) < 0.5]  # [m] from the joint that carries the link
    if not fits:
        return 1.0, 0.0, 0.0
    point = min(fits, key=lambda fit: float(fit.cost)).x
    rest, force = fitted(point)
    distance = float(np.linalg.norm(point)) / max(float(np.linalg.norm(tip)), 1e-3)
    return float(np.sum(rest**2) / np.sum(remainder**2)), float(np.median(np.linalg.norm(force, axis=1))), distance
