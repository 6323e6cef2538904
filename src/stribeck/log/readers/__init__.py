"""Readers of log files."""

from stribeck.log.readers.formats import FORMATS as FORMATS
from stribeck.log.readers.read import read_frame as read_frame
from stribeck.log.readers.read import read_log as read_log
