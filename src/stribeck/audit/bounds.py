"""What torques can be at most, and must be: the model's effort limits, and the weight that standing legs carry."""

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.linalg import null_space

from stribeck.audit.evidence import Evidence
from stribeck.audit.regression import FEWEST
from stribeck.dynamics.root_motion import gravity_in_root_link
from stribeck.dynamics.state import root_quaternions
from stribeck.typing import Array

POSTURES = 200
"""Bins that the weight is looked at in."""
PARALLEL = 0.7
"""Cosine between the torques and those of gravity, from which they are said to carry the weight."""


def over_limits(evidence: Evidence) -> dict[int, float]:
    """Return how many times its effort limit each joint's torque reaches, by joint.

    A limit below what the model needs for the motion is none.
    """
    limits = evidence.robot.effort_limits[evidence.robot.torque_controlled]
    if len(evidence.rows) < FEWEST:
        return {}
    needed = np.percentile(np.nan_to_num(np.abs(evidence.model)), 99, axis=0)
    reached = np.percentile(np.abs(evidence.torque), 99, axis=0)
    return {k: float(reached[k] / limits[k]) for k in np.flatnonzero(np.isfinite(limits) & (limits > needed)).tolist()}


def weight_carried(evidence: Evidence) -> float | None:
    """Return which share of the robot's weight the torques of standing legs carry, None if they say nothing of it.

    The wrenches W on the feet are not known, but `S^T tau = g - J^T W` at rest, so that with P the null space of J
    (and of the joints whose torque is not known) `P^T S^T tau = P^T g`: one factor is fitted to all postures.
    """
    robot, log = evidence.robot, evidence.prepared.log
    if robot.base == "fixed":
        return None
    feet_of = [[foot for foot in name.split("+") if foot in robot.contacts] for name in evidence.support_names]
    standing = np.array([bool(feet) for feet in feet_of], dtype=bool)
    bins = np.flatnonzero(standing[evidence.support]) if len(standing) else np.empty(0, dtype=np.int64)
    if len(bins) < FEWEST:
        return None
    bins = bins[:: -(-len(bins) // POSTURES)]
    gravity = _gravity(evidence, bins, feet_of)
    model = pin.Model(robot.tree.model)
    data = model.createData()
    position, torque = log.position[evidence.rows[bins]], np.zeros(model.nv)
    place = 6 + np.argsort(robot.tree.columns)[robot.torque_controlled]
    unknown = np.delete(np.eye(model.nv), [*range(6), *place.tolist()], axis=0)
    product = needed = carried = 0.0
    for row, k in enumerate(bins.tolist()):  # dense algebra of one posture at a time
        configuration = pin.neutral(model)
        configuration[7:] = position[row, robot.tree.columns]
        model.gravity.linear = gravity[row]
        weight = pin.computeGeneralizedGravity(model, data, configuration)
        pin.computeJointJacobians(model, data, configuration)
        pin.updateFramePlacements(model, data)
        jacobians = [
            pin.getFrameJacobian(model, data, model.getFrameId(contact.frame), pin.ReferenceFrame.LOCAL)[: contact.size]
            for contact in (robot.contacts[foot] for foot in feet_of[evidence.support[k]])
        ]
        free = null_space(np.vstack([*jacobians, unknown]))
        torque[place] = evidence.torque[k]
        own, asked = free.T @ torque, free.T @ weight
        product, needed, carried = product + own @ asked, needed + asked @ asked, carried + own @ own
    if needed == 0 or product < PARALLEL * np.sqrt(needed * carried):
        return None
    return float(product / needed)


def _gravity(evidence: Evidence, bins: NDArray[np.int64], feet_of: list[list[str]]) -> Array:
    """Return gravity in root link coordinates [m/s^2], shape (B, 3); without an orientation a foot is flat."""
    robot, log, rows = evidence.robot, evidence.prepared.log, evidence.rows[bins]
    if log.base_orientation is not None:
        turned = root_quaternions(robot, log.position[rows], log.base_orientation[rows])
        return gravity_in_root_link(turned, robot.gravity)
    first = [feet_of[support][0] for support in evidence.support[bins]]
    return np.array(
        [
            robot.foot_pose(foot, position[None])[0][0] @ robot.gravity
            for foot, position in zip(first, log.position[rows], strict=True)
        ]
    )
