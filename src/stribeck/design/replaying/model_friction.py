"""Joint friction stated in a model file, as the simulator of that file applies it.

R(v) = (Fc + (Fs - Fc) exp(-(v / vs)^2)) sign(v) + Fv v
"""

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from functools import cached_property

import numpy as np

from stribeck.core.base.typing import Array


@dataclass(frozen=True, kw_only=True)
class JointFriction:
    """Friction parameters of one joint: Fc and Fs - Fc [N m], vs [rad/s], Fv [N m s/rad]."""

    coulomb: float = 0.0
    viscous: float = 0.0
    rise: float = 0.0
    stribeck_velocity: float = 1.0

    def __bool__(self) -> bool:
        """Whether there is any."""
        return bool(self.coulomb or self.viscous or self.rise)


Coupling = tuple[dict[str, float], JointFriction]
"""Coefficients by joint, and friction of the sum of speeds."""

StatedFriction = tuple[dict[str, JointFriction], dict[str, Coupling], list[str]]
"""Friction stated in a model file: of joints and couplings by name, and notes on unsupported effects."""


@dataclass(frozen=True, eq=False)
class ModelFriction:
    """The friction of n joints, and of couplings with coefficients b, shape (n,): R(b . v) acts on joint j as b_j R."""

    joints: Sequence[JointFriction]
    couplings: Sequence[tuple[Array, JointFriction]] = ()

    def __bool__(self) -> bool:
        """Whether there is any."""
        return any(self.joints) or any(friction for _, friction in self.couplings)

    def torque(self, velocity: Array) -> Array:
        """Compute the torque that resists motion at velocities of shape (T, n), shape (T, n)."""
        speeds = velocity @ self._coefficients
        return np.asarray((np.sign(speeds) * self._resistance(np.abs(speeds))) @ self._coefficients.T)

    def damping(self, velocity: Array) -> Array:
        """Compute D with R = D v at velocities of shape (T, n), shape (T, n, n)."""
        creep = 1e-3  # [rad/s], [m/s]; slower friction is linear, for a finite slope at rest
        speed = np.maximum(np.abs(velocity @ self._coefficients), creep)
        slope, joints = self._resistance(speed) / speed, len(self.joints)
        matrices = slope[:, :joints, None] * np.eye(joints)
        if self.couplings:
            coupled = self._coefficients[:, joints:]
            matrices += (coupled * slope[:, None, joints:]) @ coupled.T
        return np.asarray(matrices)

    @cached_property
    def _coefficients(self) -> Array:
        """Matrix from joint velocities to the speeds of joints and couplings, shape (n, n + couplings)."""
        return np.column_stack([np.eye(len(self.joints)), *(coefficients for coefficients, _ in self.couplings)])

    @cached_property
    def _numbers(self) -> Array:
        """Friction parameters of all joints and couplings, shape (4, n + couplings)."""
        return np.array([astuple(law) for law in (*self.joints, *(friction for _, friction in self.couplings))]).T

    def _resistance(self, speed: Array) -> Array:
        coulomb, viscous, rise, stribeck_velocity = self._numbers
        return np.asarray(coulomb + rise * np.exp(-((speed / stribeck_velocity) ** 2)) + viscous * speed)
