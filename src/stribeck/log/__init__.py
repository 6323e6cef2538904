"""Logs of robots: read from files, checked, and evenly resampled."""

from stribeck.log.robot_log import RobotLog as RobotLog
