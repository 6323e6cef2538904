"""Simulated robots: logs and their ground truth."""
