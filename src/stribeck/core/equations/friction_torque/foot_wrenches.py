"""Measured foot wrenches, and their effect on the joints between base and ground (docs/other-methods.md)."""

from collections.abc import Mapping

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.errors import LogError
from stribeck.core.log import RobotLog
from stribeck.core.log.channels import WRENCH
from stribeck.core.robot import Robot
from stribeck.core.robot.kinematics import joint_torque_of_wrench

REMEDY = "map the sensors in [log.foot_wrench], or choose the method whole-log or curve-fit, which needs no wrenches"


def require_wrenches(log: RobotLog, robot: Robot) -> None:
    """Refuse a log that lacks a wrench on some foot: three forces, and for a surface three moments.

    Raises
    ------
    LogError
        If the channel, a foot or an axis is missing.
    """
    name = log.path or "log"
    if log.foot_wrench is None:
        raise LogError(
            f"{name}: friction of standing legs requires the channel foot_wrench, which is missing; expected "
            f"force and moment of the ground on {', '.join(robot.contacts)}; {REMEDY}"
        )
    missing = [foot for foot in robot.contacts if foot not in log.foot_names]
    if missing:
        raise LogError(
            f"{name}: foot_wrench has no wrench on '{missing[0]}', only on {', '.join(log.foot_names) or 'no foot'}; "
            f"expected wrenches on {', '.join(robot.contacts)}; {REMEDY}"
        )
    for foot, contact in robot.contacts.items():
        felt = np.any(log.foot_wrench[:, log.foot_names.index(foot)], axis=0)
        if not felt[: contact.size].all():
            axes = ", ".join(axis for axis, used in zip(WRENCH, felt, strict=True) if used) or "no axis"
            raise LogError(
                f"{name}: the wrench on '{foot}' has only {axes}, other axes are always zero; expected "
                f"{', '.join(WRENCH[: contact.size])}; {REMEDY}"
            )


def effect_on_joints(
    robot: Robot, position: Array, wrenches: Mapping[str, Array], root_foot: str | None, needed: Array
) -> Array:
    """Compute the correction of a rooted tree's friction torque by measured wrenches, shape (T, n).

    With J a foot's Jacobian relative to a fixed base, it is the sum of J^T w over the standing feet. If the tree is
    rooted at one of them, the required wrench at the root is subtracted from that foot's w: its joints then carry only
    the parts between them and that foot, no longer the rest of the robot.

    Parameters
    ----------
    robot, position
        Robot, and positions of its joints, shape (T, n).
    wrenches
        Wrench on each standing foot in its frame, shape (T, 6).
    root_foot
        Foot at the root of the tree; None if the root is no foot.
    needed
        Wrench on the root that the motion requires, shape (T, 6).
    """
    effect, tree = np.zeros_like(position), robot.tree
    for foot, wrench in wrenches.items():
        frame = tree.model.getFrameId(robot.contacts[foot].frame)
        effect += joint_torque_of_wrench(tree, frame, position, wrench - needed if foot == root_foot else wrench)
    return effect
