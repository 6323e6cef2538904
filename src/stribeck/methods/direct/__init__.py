"""Friction and inertial parameters together, by least squares on the dynamic regressor (docs/direct.md)."""
