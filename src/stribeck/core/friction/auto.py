"""Friction as a sum of terms; each joint has the terms that its log supports."""

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.friction.law import Parameter
from stribeck.core.friction.parameters import COULOMB, OFFSET, SLOPE, STRIBECK_GAIN, STRIBECK_VELOCITY, VISCOUS
from stribeck.core.friction.stribeck import Stribeck

JUMP = 1e9
"""Slope [s/rad] of friction that jumps at standstill: any nonzero velocity is beyond the rise."""


class AutoLaw(Stribeck):
    """Terms of `--law auto` that depend on velocity.

    R(v) = Fv (v + alpha |v|) + Fc tanh(a v) (1 + S exp(-(v / vs)^2)) + offset

    A missing term has its `neutral` value: no viscous friction, a jump at standstill instead of a rise, no Stribeck
    effect, the same viscous friction in both directions. Coulomb friction that differs between the directions is an
    offset, because no log distinguishes the two. Values may have more axes, which broadcast with the velocity's.
    """

    name: ClassVar[str] = "auto"
    title: ClassVar[str] = "As many terms as the log supports"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        replace(VISCOUS, neutral=0.0),
        COULOMB,
        replace(STRIBECK_GAIN, neutral=0.0),
        replace(STRIBECK_VELOCITY, neutral=1.0),
        OFFSET,
        replace(SLOPE, neutral=JUMP),
        Parameter(name="viscous_asymmetry", symbol="alpha", unit="1", lower=-1.0, upper=1.0, neutral=0.0),
    )
    free_coefficients: ClassVar[tuple[int, ...]] = (3, 4)
    jumps: ClassVar[bool] = True

    def torque(self, velocity: Array, values: Array) -> Array:
        """Compute R(v) [N m], shape (N,)."""
        return np.asarray(super().torque(velocity, values[:-1]) + values[0] * values[-1] * np.abs(velocity))

    def jacobian(self, velocity: Array, values: Array) -> Array:
        """Compute dR/dp, shape (N, 7), in the order of `parameters`."""
        columns = np.column_stack([super().jacobian(velocity, values[:-1]), values[0] * np.abs(velocity)])
        columns[:, 0] += values[-1] * np.abs(velocity)
        return np.asfortranarray(columns)

    def basis(self, velocity: Array, shape: Mapping[str, float]) -> Array:
        """Compute the columns v, tanh(a v), tanh(a v) exp(-(v / vs)^2), 1, |v|, shape (N, 5)."""
        return np.column_stack([super().basis(velocity, shape), np.abs(velocity)])

    def from_linear(self, coefficients: Array, shape: Mapping[str, float]) -> Array:
        """Compute the parameters from (Fv, Fc, Fc S, offset, Fv alpha) and the nonlinear parameters."""
        viscous, difference = coefficients[0], coefficients[-1]
        alpha = float(np.clip(difference / viscous, -1.0, 1.0)) if viscous > 0 else 0.0
        return np.append(super().from_linear(coefficients[:-1], shape), alpha)
