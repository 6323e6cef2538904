"""Readers of log files."""

from stribeck.io.readers.formats import FORMATS as FORMATS
from stribeck.io.readers.read import read_frame as read_frame
from stribeck.io.readers.read import read_log as read_log
