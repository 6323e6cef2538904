"""What happened: a robot's recorded signals, read from any file, checked and put on an even clock."""

from stribeck.log.robot_log import RobotLog as RobotLog
