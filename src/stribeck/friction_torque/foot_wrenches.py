"""What measured foot wrenches say about the joints between base and ground (docs/other-methods.md)."""

from collections.abc import Mapping

import numpy as np

from stribeck.base.typing import Array
from stribeck.errors import LogError
from stribeck.log import RobotLog
from stribeck.robot import Robot
from stribeck.robot.kinematics import joint_torque_of_wrench

AXES = ("fx", "fy", "fz", "tx", "ty", "tz")
CURE = "map the sensors in [log.foot_wrench], or take --method whole-log or curve-fit, which need no wrenches"


def require_wrenches(log: RobotLog, robot: Robot) -> None:
    """Refuse a log without the whole wrench on every foot: three forces, and on a surface three moments.

    Raises
    ------
    LogError
        If the channel, a foot or an axis is missing.
    """
    name = log.path or "log"
    if log.foot_wrench is None:
        raise LogError(
            f"{name}: there is no channel foot_wrench, from which the friction of standing legs shall follow; expected "
            f"force and moment of the ground on {', '.join(robot.contacts)}; {CURE}"
        )
    missing = [foot for foot in robot.contacts if foot not in log.foot_names]
    if missing:
        raise LogError(
            f"{name}: foot_wrench has no wrench on '{missing[0]}', but on {', '.join(log.foot_names) or 'no foot'}; "
            f"expected one on {', '.join(robot.contacts)}; {CURE}"
        )
    for foot, contact in robot.contacts.items():
        felt = np.any(log.foot_wrench[:, log.foot_names.index(foot)], axis=0)
        if not felt[: contact.size].all():
            axes = ", ".join(axis for axis, used in zip(AXES, felt, strict=True) if used) or "no axis"
            raise LogError(
                f"{name}: the wrench on '{foot}' has {axes} alone, the others are zero throughout; expected "
                f"{', '.join(AXES[: contact.size])}; {CURE}"
            )


def effect_on_joints(
    robot: Robot, position: Array, wrenches: Mapping[str, Array], root_foot: str | None, needed: Array
) -> Array:
    """Return what measured wrenches add to the friction torque that a rooted tree gives, shape (T, n).

    With J a foot's Jacobian while the base is held, it is the sum of J^T w over the standing feet. Where the tree is
    rooted at one of them, the wrench that the motion needs there goes off its w: its joints then carry what lies
    between them and that foot, no longer all the rest.

    Parameters
    ----------
    robot, position
        The robot, and its joints' positions, shape (T, n).
    wrenches
        By standing foot, in its frame, shape (T, 6).
    root_foot
        Foot that the tree is rooted at, None if none.
    needed
        Wrench that the motion needs on its root, shape (T, 6).
    """
    effect, tree = np.zeros_like(position), robot.tree
    for foot, wrench in wrenches.items():
        frame = tree.model.getFrameId(robot.contacts[foot].frame)
        effect += joint_torque_of_wrench(tree, frame, position, wrench - needed if foot == root_foot else wrench)
    return effect
