"""The command line: commands, and what they print."""

from stribeck.cli.app import main as main
