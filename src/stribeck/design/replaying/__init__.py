"""Comparison of a log with models: required torque, and motion of the joints under the measured torque."""
