"""Viscous friction that the log does not distinguish from a delay of commands."""

from collections.abc import Mapping

from stribeck.base.finding import Finding
from stribeck.log import RobotLog
from stribeck.result import JointResult
from stribeck.robot import Robot

SHARE = 0.25
"""Share of the viscous friction [1] that the 95 % interval of the delay may change before it is reported."""

PERIOD = 0.02
"""Delay for which the change of the viscous friction is reported [s]."""


def inseparable_delays(joints: Mapping[str, JointResult], log: RobotLog, robot: Robot) -> list[Finding]:
    """Report joints whose viscous friction depends on the delay of their commands more than the log determines it.

    A command that acts d later adds kp d to the viscous friction that a log without delays seems to show.
    """
    if not log.command_delays or robot.command_gains is None:
        return []
    found = {}
    for name, kp, (delay, error) in zip(robot.joint_names, robot.command_gains[0], log.command_delays, strict=True):
        kp /= log.unscaled.get(name, 1.0)
        viscous = joints[name].parameters.get("viscous") if name in joints else None
        if viscous is not None and 2 * kp * error > SHARE * viscous.value:
            at_once = viscous.value + kp * delay
            found[name] = f" ({at_once:.2g} {viscous.unit} if commands act at once, {kp * PERIOD:.2g} less per 20 ms)"
    return [Finding.of("command-delay.inseparable", found)] if found else []
