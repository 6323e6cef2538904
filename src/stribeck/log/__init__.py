"""Logs of robots: read from files, checked, and evenly resampled."""

from stribeck.base.frame import Frame as Frame
from stribeck.log.robot_log import LogLike as LogLike
from stribeck.log.robot_log import RobotLog as RobotLog
