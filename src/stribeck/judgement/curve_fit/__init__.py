"""Friction laws fitted joint by joint to samples of the friction torque."""
