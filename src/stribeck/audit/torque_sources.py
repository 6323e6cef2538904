"""Torques of logs whose source is a current or a command."""

from collections.abc import Sequence

from stribeck.audit.command_delay import with_found_delays
from stribeck.audit.currents import torques_of_currents
from stribeck.base.finding import Finding
from stribeck.friction_torque.preparation import PreparedLog
from stribeck.robot import Robot
from stribeck.settings import Settings


def find_torques(
    prepared: Sequence[PreparedLog], robot: Robot, settings: Settings, unseen: Sequence[PreparedLog] = ()
) -> tuple[list[PreparedLog], list[Finding], dict[str, float]]:
    """Find unknown torque constants and delays of commands, and compute the torques with them.

    Both are found only in the prepared logs; delays also apply to the logs that no fit may see.

    Returns
    -------
    logs, findings, gain_errors
        All logs, unseen logs last; logs with measured torques are unchanged. Gain errors are relative standard errors
        [1] by joint.

    Raises
    ------
    LogError
        If gravity does not determine the torque per ampere of a joint.
    """
    logs, findings, gain_errors = torques_of_currents(prepared, robot, settings)
    logs, of_commands = with_found_delays(logs, robot, settings, unseen)
    return logs, [*findings, *of_commands], gain_errors
