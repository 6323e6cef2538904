"""Torques of logs whose source is a current or a command."""

from collections.abc import Sequence

from stribeck.audit.command_delay import with_found_delays
from stribeck.audit.currents import torques_of_currents
from stribeck.base.finding import Finding
from stribeck.friction_torque.preparation import PreparedLog
from stribeck.robot import Robot
from stribeck.settings import Settings


def find_torques(
    prepared: Sequence[PreparedLog], robot: Robot, settings: Settings
) -> tuple[list[PreparedLog], list[Finding], dict[str, float]]:
    """Find unknown torque constants and delays of commands, and compute the torques with them.

    Returns
    -------
    logs, findings, gain_errors
        Logs of measured torques are returned unchanged. Gain errors are relative standard errors [1] by joint.

    Raises
    ------
    LogError
        If gravity does not determine the torque per ampere of a joint.
    """
    if not prepared:
        return [], [], {}
    logs, findings, gain_errors = torques_of_currents(prepared, robot, settings)
    logs, of_commands = with_found_delays(logs, robot, settings)
    return logs, [*findings, *of_commands], gain_errors
