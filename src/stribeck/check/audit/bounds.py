"""Bounds of torques by the robot's weight and the model's effort limits."""

import numpy as np
import pinocchio as pin
from scipy.linalg import null_space

from stribeck.check.audit.evidence import LEAST_BINS, AuditData
from stribeck.check.audit.units import FAR, UNITS, concerns_most, possible_causes, unit_of
from stribeck.core.base.finding import Finding
from stribeck.core.dynamics.contact.phases import up_in_base
from stribeck.core.robot.scale_setting import scale_setting


def out_of_bounds(evidence: AuditData, joints: list[int]) -> list[Finding]:
    """Report torques that contradict the robot's weight or the model's effort limits.

    These limit the scale of joints whose model torque is too small a share of the torque for a gain.
    """
    carried = _weight_carried(evidence)
    if carried is not None and not 1 / FAR < carried < FAR:
        unit = unit_of(carried)
        if unit is None:
            causes = possible_causes(carried)
            return [Finding.of("torque-scale.weight-unclear", evidence.joints, factor=carried, causes=causes)]
        setting, named = scale_setting(evidence.robot, dict.fromkeys(evidence.joints, 1 / unit)), UNITS[unit]
        return [Finding.of("torque-scale.weight", evidence.joints, factor=carried, unit=named, settings=[setting])]
    reached = {k: times for k, times in _over_limits(evidence).items() if k in joints}
    over = {evidence.joints[k]: f" ({times:.3g} times)" for k, times in reached.items() if times > FAR}
    if not over:
        return []
    most = concerns_most(len(over), len(reached), evidence.joints)
    setting = scale_setting(evidence.robot, dict.fromkeys(evidence.joints if most else over, 1e-3))
    check = "torque-scale.limits" if most else "torque-gain.limits"
    return [Finding.of(check, over, stops=most, settings=[setting])]


def _over_limits(evidence: AuditData) -> dict[int, float]:
    """Divide the largest torque of each joint by its effort limit.

    Limits below the torque that the motion requires are ignored.
    """
    limits = evidence.robot.effort_limits[evidence.robot.torque_controlled]
    if len(evidence.rows) < LEAST_BINS:
        return {}
    needed = np.percentile(np.nan_to_num(np.abs(evidence.model)), 99, axis=0)
    reached = np.percentile(np.abs(evidence.torque), 99, axis=0)
    return {k: float(reached[k] / limits[k]) for k in np.flatnonzero(np.isfinite(limits) & (limits > needed)).tolist()}


def _weight_carried(evidence: AuditData) -> float | None:
    """Estimate the share of the robot's weight that the torques of standing legs carry; None if undetermined.

    The wrenches W on the feet are unknown, but `S^T tau = g - J^T W` at rest. With P the null space of J (and of the
    joints whose torque is unknown) `P^T S^T tau = P^T g`: one factor is fitted to 200 postures. It is undetermined if
    the cosine between the two sides is below 0.7.
    """
    robot, log = evidence.robot, evidence.prepared.log
    if robot.base == "fixed":
        return None
    feet_of = evidence.support_feet
    bins = np.flatnonzero(np.array([bool(feet) for feet in feet_of], dtype=bool)[evidence.support])
    if len(bins) < LEAST_BINS:
        return None
    bins = bins[:: -(-len(bins) // 200)]
    gravity = -np.linalg.norm(robot.gravity) * up_in_base(log.take(evidence.rows[bins]), robot)
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
        measured, asked = free.T @ torque, free.T @ weight
        product, needed, carried = product + measured @ asked, needed + asked @ asked, carried + measured @ measured
    if needed == 0 or product < 0.7 * np.sqrt(needed * carried):
        return None
    return float(product / needed)
