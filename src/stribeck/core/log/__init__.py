"""Logs of robots: read from files, checked, and evenly resampled."""

from stribeck.core.base.frame import Frame as Frame
from stribeck.core.log.robot_log import LogLike as LogLike
from stribeck.core.log.robot_log import RobotLog as RobotLog
