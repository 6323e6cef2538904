"""Whole-body torques that follow a walking plan, from a quadratic program."""
