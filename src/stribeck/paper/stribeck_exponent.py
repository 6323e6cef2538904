"""The Stribeck law with a free exponent."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.friction.law import FrictionLaw, Parameter
from stribeck.core.friction.parameters import OFFSET
from stribeck.core.friction.stribeck import Stribeck, from_coefficients


class StribeckExponent(FrictionLaw):
    """Stribeck friction with a free exponent, (3.3) of Egle 2021 with viscous friction and an offset.

    R(v) = Fv v + Fc sgn(v) (1 + S exp(-|v / vs|^delta)) + offset, with sgn(0) = 0 and S = (Fs - Fc) / Fc

    When to use it: long, clean logs with much slow motion, to learn how sharply friction falls: delta = 1 is Tustin's
    exponential, 2 the Gaussian of the smooth law. The sign is a true jump, so the log must have few samples whose
    velocity is only noise.
    """

    name: ClassVar[str] = "stribeck-exponent"
    title: ClassVar[str] = "Stribeck with a free exponent"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        *Stribeck.parameters[:4],
        Parameter(
            name="exponent", symbol="delta", unit="1", lower=0.2, upper=8.0, starts=(0.7, 1.3, 2.5), logarithmic=True
        ),
        OFFSET,
    )
    free_coefficients: ClassVar[tuple[int, ...]] = (3,)
    jumps: ClassVar[bool] = True

    def torque(self, velocity: Array, values: Array) -> Array:
        """Compute R(v) [N m], shape (N,)."""
        Fv, Fc, S, vs, delta, offset = values
        weakening = np.exp(-((np.abs(velocity) / vs) ** delta))
        return np.asarray(Fv * velocity + Fc * np.sign(velocity) * (1.0 + S * weakening) + offset)

    def jacobian(self, velocity: Array, values: Array) -> Array:
        """Compute dR/dp, shape (N, 6), in the order of `parameters`."""
        _, Fc, S, vs, delta, _ = values
        ratio = np.abs(velocity) / vs
        power = ratio**delta
        sign, weakening = np.sign(velocity), np.exp(-power)
        # x^delta ln x tends to 0 at standstill, where ln x does not exist
        logarithm = np.log(ratio, out=np.zeros_like(ratio), where=ratio > 0)
        columns = np.empty((len(velocity), 6), order="F")
        columns[:, 0] = velocity
        columns[:, 1] = sign * (1.0 + S * weakening)
        columns[:, 2] = Fc * sign * weakening
        columns[:, 3] = Fc * S * sign * weakening * power * delta / vs
        columns[:, 4] = -Fc * S * sign * weakening * power * logarithm
        columns[:, 5] = 1.0
        return columns

    def basis(self, velocity: Array, shape: Mapping[str, float]) -> Array:
        """Compute the columns v, sgn(v), sgn(v) exp(-|v / vs|^delta), 1, shape (N, 4)."""
        weakening = np.exp(-((np.abs(velocity) / shape["stribeck_velocity"]) ** shape["exponent"]))
        sign = np.sign(velocity)
        return np.column_stack([velocity, sign, sign * weakening, np.ones_like(velocity)])

    def from_linear(self, coefficients: Array, shape: Mapping[str, float]) -> Array:
        """Compute the six parameters from (Fv, Fc, Fc S, offset) and the nonlinear parameters."""
        *linear, offset = coefficients
        return np.array([*from_coefficients(*linear), shape["stribeck_velocity"], shape["exponent"], offset])
