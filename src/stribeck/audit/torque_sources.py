"""Torques of logs whose source is a current or a command."""

from dataclasses import replace

import numpy as np

from stribeck.audit.command_delay import with_found_delays
from stribeck.audit.unknown_gains import Gain, find_gains, gain_findings, with_gains
from stribeck.base.finding import Finding
from stribeck.friction_torque.preparation import Logs, PreparedLog
from stribeck.robot import Robot
from stribeck.settings import Settings


def find_torques(
    prepared: Logs, robot: Robot, settings: Settings, unseen: Logs = ()
) -> tuple[list[PreparedLog], list[Finding], dict[str, float], Robot]:
    """Find unknown torque constants, kp and delays of commands, and compute the torques with them.

    They are found only in the prepared logs, and also apply to the logs that no fit may see. Torques of joints in
    `RobotLog.unscaled` have a rough factor.

    Returns
    -------
    logs, findings, gain_errors, robot
        All logs, unseen logs last; logs with measured torques are unchanged. Gain errors are relative standard errors
        [1] by joint. The robot has kp of every joint.

    Raises
    ------
    LogError
        If the torque of a joint has the wrong sign.
    """
    every, count, of_delays = [*prepared, *unseen], len(prepared), list[Finding]()
    if not every[0].log.unscaled:
        return *with_found_delays(prepared, robot, settings, unseen), {}, robot
    if every[0].log.command is not None:  # kp is needed to find the delays, and without the delays it is 10 % off
        gains = find_gains(prepared, robot, settings)
        every, robot = [with_gains(part, gains, rough=True) for part in every], _with_kp(robot, gains)
        every, of_delays = with_found_delays(every[:count], robot, settings, every[count:])
    gains = find_gains(every[:count], robot, settings)
    every = [with_gains(part, gains, rough=False) for part in every]
    errors = {name: gain.half_width / gain.value / 2 for name, gain in gains.items()}
    findings = [*gain_findings(gains, every[0].log.channel_unit(prismatic=False)), *of_delays]
    return every, findings, errors, _with_kp(robot, gains)


def _with_kp(robot: Robot, gains: dict[str, Gain]) -> Robot:
    """Complete kp of the drives if commands are the torque source."""
    if robot.command_gains is None:
        return robot
    kp, kd = robot.command_gains
    values = [gains[name].value if name in gains else own for name, own in zip(robot.joint_names, kp, strict=True)]
    return replace(robot, command_gains=(np.array(values), kd))
