"""The smooth Stribeck law."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.friction.law import FrictionLaw, Parameter
from stribeck.core.friction.parameters import (
    COULOMB,
    MAX_GAIN,
    OFFSET,
    SLOPE,
    STRIBECK_GAIN,
    STRIBECK_VELOCITY,
    VISCOUS,
)


def from_coefficients(viscous: float, kinetic: float, excess: float) -> tuple[float, float, float]:
    """Compute Fv [N m s/rad], Fc [N m] and a bounded S [1] from the coefficients in Fv v + (kinetic + excess w) sgn(v).

    If the kinetic part vanishes, S is at its bound and Fc keeps the breakaway level.
    """
    coulomb = max(kinetic, excess / MAX_GAIN, 0.0)
    gain = min(max(excess, 0.0) / coulomb, MAX_GAIN) if coulomb > 0 else 0.0
    return max(viscous, 0.0), coulomb, gain


class Stribeck(FrictionLaw):
    """Viscous, Coulomb and Stribeck friction, continuous at standstill, (3.5) of Egle 2021 with delta = 2.

    R(v) = Fv v + Fc tanh(a v) (1 + S exp(-(v / vs)^2)) + offset

    When to use it: the default, for logs that pass slowly through standstill and also move clearly faster than vs.
    """

    name: ClassVar[str] = "stribeck"
    title: ClassVar[str] = "Smooth Stribeck"
    parameters: ClassVar[tuple[Parameter, ...]] = (VISCOUS, COULOMB, STRIBECK_GAIN, STRIBECK_VELOCITY, OFFSET, SLOPE)
    free_coefficients: ClassVar[tuple[int, ...]] = (3,)

    def torque(self, velocity: Array, values: Array) -> Array:
        """Compute R(v) [N m], shape (N,)."""
        Fv, Fc, S, vs, offset, a = values
        return np.asarray(Fv * velocity + Fc * np.tanh(a * velocity) * (1.0 + S * bell(velocity, vs)) + offset)

    def jacobian(self, velocity: Array, values: Array) -> Array:
        """Compute dR/dp, shape (N, 6), in the order of `parameters`."""
        _, Fc, S, vs, _, a = values
        sign = np.tanh(a * velocity)
        weight = bell(velocity, vs)
        level = 1.0 + S * weight
        columns = np.empty((len(velocity), 6), order="F")
        columns[:, 0] = velocity
        columns[:, 1] = sign * level
        columns[:, 2] = Fc * sign * weight
        columns[:, 3] = columns[:, 2] * S * 2.0 * (velocity / vs) ** 2 / vs
        columns[:, 4] = 1.0
        columns[:, 5] = Fc * level * velocity * (1.0 - sign**2)
        return columns

    def basis(self, velocity: Array, shape: Mapping[str, float]) -> Array:
        """Compute the columns v, tanh(a v), tanh(a v) exp(-(v / vs)^2), 1, shape (N, 4)."""
        sign = np.tanh(shape["slope"] * velocity)
        weight = bell(velocity, shape["stribeck_velocity"])
        return np.column_stack([velocity, sign, sign * weight, np.ones_like(velocity)])

    def from_linear(self, coefficients: Array, shape: Mapping[str, float]) -> Array:
        """Compute the six parameters from (Fv, Fc, Fc S, offset) and the nonlinear parameters."""
        *linear, offset = coefficients
        return np.array([*from_coefficients(*linear), shape["stribeck_velocity"], offset, shape["slope"]])


def bell(velocity: Array, stribeck_velocity: float) -> Array:
    """Compute the weight of the Stribeck effect, exp(-(v / vs)^2)."""
    return np.asarray(np.exp(-((velocity / stribeck_velocity) ** 2)))
