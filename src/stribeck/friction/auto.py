"""Friction as a sum of terms; each joint has the terms that its log supports."""

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from stribeck.base.typing import Array
from stribeck.friction.law import Parameter
from stribeck.friction.parameters import COULOMB, OFFSET, SLOPE, STRIBECK_GAIN, STRIBECK_VELOCITY, VISCOUS
from stribeck.friction.stribeck import Stribeck

JUMP = 1e9
"""Slope [s/rad] of friction that jumps at standstill: any nonzero velocity is beyond the rise."""


def beyond_velocity(
    values: Mapping[str, float],
    velocity: Array,
    load: ArrayLike,
    temperature: ArrayLike,
    cosine: ArrayLike = 0.0,
    sine: ArrayLike = 0.0,
    angle: ArrayLike | None = None,
) -> Array:
    """Compute the friction due to load, temperature and position, in addition to friction due to velocity [N m].

    mu |load| tanh(a v) + dT (Fc_T tanh(a v) + Fv_T v) + (Fc_c cosine + Fc_s sine) tanh(a v)
        + tau_c cos(angle) + tau_s sin(angle), with the terms that the joint has

    Parameters
    ----------
    values
        Parameters of the joint by name.
    velocity, load, temperature, cosine, sine
        Velocity [rad/s], load [N m], temperature minus its mean [K], and cosine and sine of the position minus their
        means; the shapes broadcast.
    angle
        Position times the ripple's periods per turn [rad]; None without ripple.
    """
    rise, warmer = np.tanh(values.get("slope", JUMP) * velocity), np.asarray(temperature)
    slow = values.get("coulomb_per_kelvin", 0.0) * rise + values.get("viscous_per_kelvin", 0.0) * velocity
    turned = values.get("coulomb_cosine", 0.0) * np.asarray(cosine) + values.get("coulomb_sine", 0.0) * np.asarray(sine)
    found = (values.get("load", 0.0) * np.abs(load) + turned) * rise + warmer * slow
    if angle is None:
        return np.asarray(found)
    ripple = values.get("ripple_cosine", 0.0) * np.cos(angle) + values.get("ripple_sine", 0.0) * np.sin(angle)
    return np.asarray(found + ripple)


def drift(values: Mapping[str, float], velocity: Array) -> Array:
    """Compute the change of friction from the start of a log to its end [N m]: Fc_t tanh(a v) + Fv_t v."""
    rise = np.tanh(values.get("slope", JUMP) * velocity)
    return np.asarray(values.get("coulomb_drift", 0.0) * rise + values.get("viscous_drift", 0.0) * velocity)


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
