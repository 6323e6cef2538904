"""Logs of robots, read from the files they come in."""

from stribeck.readers.read import FORMATS as FORMATS
from stribeck.readers.read import read_log as read_log
