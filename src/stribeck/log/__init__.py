"""Logs of robots: read from files, checked, and evenly resampled."""

from stribeck.log.robot_log import Frame as Frame
from stribeck.log.robot_log import LogLike as LogLike
from stribeck.log.robot_log import RobotLog as RobotLog
