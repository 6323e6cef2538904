"""Setting that corrects the scale of a channel."""

from collections.abc import Mapping

from stribeck.core.base.finding import Setting, rounded
from stribeck.core.robot.robot import Robot


def scale_setting(robot: Robot, factors: Mapping[str, float], channel: str = "torque") -> Setting:
    """Make the setting that multiplies a channel by a factor per joint, in addition to the present scale.

    It is one number if all joints with a torque have the same factor, otherwise one value per joint name of the log;
    without a value if the present scale is a list in the log's joint order.
    """
    table, present = f"log.{channel}", getattr(robot.log_table, channel).scale
    joints = [robot.joint_names[column] for column in robot.torque_controlled]
    if isinstance(present, list):
        return Setting(table, "scale")
    if set(factors) == set(joints) and len(set(factors.values())) == 1 and not isinstance(present, dict):
        return Setting(table, "scale", rounded(present * next(iter(factors.values())), 4))
    logged = {model: name for name, model in robot.log_table.joint_names.items()}
    scales = {}
    for joint in joints:
        name = logged.get(joint, joint)
        before = present.get(name, 1.0) if isinstance(present, dict) else present
        if joint in factors or before != 1:
            scales[name] = rounded(before * factors.get(joint, 1.0), 4)
    return Setting(table, "scale", scales)
