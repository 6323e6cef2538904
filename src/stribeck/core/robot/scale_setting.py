"""Setting that corrects the scale of a channel."""

from collections.abc import Mapping

from stribeck.core.base.finding import Setting, rounded
from stribeck.core.robot.robot import Robot


def scale_setting(robot: Robot, factors: Mapping[str, float], channel: str = "torque", digits: int = 4) -> Setting:
    """Make the setting that multiplies a channel by a rounded factor per joint, in addition to the present scale.

    It is one number if all joints of the channel have the same factor, otherwise one value per joint name of the log;
    without a value if the present scale is a list in the log's joint order.
    """
    entry, factors = getattr(robot.log_table, channel), {joint: rounded(x, digits) for joint, x in factors.items()}
    table, present, own = f"log.{channel}", entry.scale, entry.name if isinstance(entry.name, list) else None
    columns = robot.torque_controlled.tolist() if "torque" in channel else range(len(robot.joint_names))
    joints = [robot.joint_names[column] for column in columns]
    if isinstance(present, list):
        return Setting(table, "scale")
    if set(factors) == set(joints) and len(set(factors.values())) == 1 and not isinstance(present, dict):
        return Setting(table, "scale", rounded(present * next(iter(factors.values())), 9))
    logged = {joint: label for label, joint in robot.log_table.joint_names.items() if own is None or label in own}
    names = {joint: logged.get(joint, joint) for joint in joints}
    before = {joint: present.get(name, 1.0) if isinstance(present, dict) else present for joint, name in names.items()}
    scales = {joint: rounded(old * factors.get(joint, 1.0), 9) for joint, old in before.items()}
    return Setting(table, "scale", {names[joint]: x for joint, x in scales.items() if joint in factors or x != 1})
