"""Fit of a law to the samples of friction torque."""
