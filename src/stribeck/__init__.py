"""Whole-body joint friction of legged robots and arms, from the logs they already record."""

from stribeck.export import export as export
from stribeck.pipeline import identify as identify
from stribeck.readers import read_log as read_log
from stribeck.report import write_report as write_report
from stribeck.robot import Robot as Robot
from stribeck.settings import Settings as Settings
from stribeck.version import __version__ as __version__
