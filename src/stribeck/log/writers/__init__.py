"""Logs of robots, written under the names that are read without any setting."""

from stribeck.log.writers.write import WRITERS as WRITERS
from stribeck.log.writers.write import write_log as write_log
