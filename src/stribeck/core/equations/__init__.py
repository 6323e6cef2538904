"""Equations of motion of a robot and a log."""
