"""Logs without faults, and the checks that find something in a log."""

from dataclasses import dataclass

from stribeck import LogError, Robot
from stribeck.check.audit import audit
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.log import RobotLog


@dataclass(frozen=True, eq=False)
class CleanLog:
    """Robot as described by its model, and its log without faults."""

    robot: Robot
    log: RobotLog


def checks_of(log: RobotLog, robot: Robot) -> tuple[list[str], str]:
    """List the checks with findings, and the error if the log was refused."""
    try:
        return [f.check for f in audit(prepare(log, robot, robot.settings), robot, robot.settings)], ""
    except LogError as error:
        return ["refused"], str(error)
