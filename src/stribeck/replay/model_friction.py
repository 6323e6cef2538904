"""The joint friction that a model file states itself, as its simulator would apply it.

R(v) = (Fc + (Fs - Fc) exp(-(v / vs)^2)) sign(v) + Fv v
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from functools import cached_property

import numpy as np

from stribeck.typing import Array

CREEP = 1e-3
"""Speed below which friction is viscous in a rollout, so that it has a slope at rest [rad/s], [m/s]."""


@dataclass(frozen=True, kw_only=True)
class JointFriction:
    """Numbers of one joint: Fc and what Fs adds to it [N m], vs [rad/s], Fv [N m s/rad]."""

    coulomb: float = 0.0
    viscous: float = 0.0
    rise: float = 0.0
    stribeck_velocity: float = 1.0

    def __bool__(self) -> bool:
        """Whether there is any."""
        return bool(self.coulomb or self.viscous or self.rise)


@dataclass(frozen=True, eq=False)
class ModelFriction:
    """The friction of n joints."""

    joints: Sequence[JointFriction]

    def __bool__(self) -> bool:
        """Whether any joint has some."""
        return any(self.joints)

    def torque(self, velocity: Array) -> Array:
        """Return the torque that resists motion at these velocities, shape (T, n) both."""
        return np.asarray(np.sign(velocity) * self._resistance(np.abs(velocity)))

    def slope(self, velocity: Array) -> Array:
        """Return the friction torque over the velocity, which is finite at rest, shape (T, n) both."""
        speed = np.maximum(np.abs(velocity), CREEP)
        return self._resistance(speed) / speed

    @cached_property
    def _numbers(self) -> Array:
        """The numbers of all joints, shape (4, n)."""
        return np.array([astuple(joint) for joint in self.joints]).T

    def _resistance(self, speed: Array) -> Array:
        coulomb, viscous, rise, stribeck_velocity = self._numbers
        return np.asarray(coulomb + rise * np.exp(-((speed / stribeck_velocity) ** 2)) + viscous * speed)
