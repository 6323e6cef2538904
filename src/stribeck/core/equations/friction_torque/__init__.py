"""Friction torque of every sample: computed, thinned for the fit, and written as a table."""
