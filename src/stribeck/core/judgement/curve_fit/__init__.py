"""Fit of friction laws to samples of the friction torque, per joint."""
