"""Commanded torques of a log whose commands act later than they are logged."""

from dataclasses import replace

import numpy as np

from stribeck.base.typing import Array
from stribeck.log.robot_log import RobotLog
from stribeck.log.storage import allocate


def with_command_delay(log: RobotLog, delay: Array) -> RobotLog:
    """Compute the torques of a log anew for commands that act a delay per joint [s], shape (n,), later."""
    assert log.command is not None
    assert log.feedback is not None
    command = allocate(log.command.shape)
    for column, late in enumerate(delay.tolist()):
        command[:, column] = np.interp(log.time - late, log.time, log.command[:, column])
    limits = np.array(log.effort_limits)
    return replace(log, command=command, torque=np.clip(command + log.feedback, -limits, limits))
