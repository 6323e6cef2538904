"""Logs of robots, read from the files they come in."""

from stribeck.log.readers.read import FORMATS as FORMATS
from stribeck.log.readers.read import read_frame as read_frame
from stribeck.log.readers.read import read_log as read_log
