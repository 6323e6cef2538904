"""Uncertainty of the solution, and its sources."""
