"""Coulomb and viscous friction per direction of motion."""

from typing import ClassVar

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.friction.law import FrictionLaw, Parameter


class Asymmetric(FrictionLaw):
    """Coulomb and viscous friction per direction of motion.

    R(v) = Fv+ v + Fc+   for v > 0
    R(v) = Fv- v - Fc-   for v < 0
    R(0) = 0

    There is no separate offset, because a log shows only the two levels Fc+ and -Fc-, which include it: with symmetric
    friction Fc and an offset, Fc+ = Fc + offset and Fc- = Fc - offset. If a torque sensor is off by more than Fc, one
    level reaches its bound of zero, which the verdict reports.

    When to use it: gears whose teeth or seals differ between the directions (worm and hypoid gears, joints under a
    constant load), after `coulomb-viscous` has left a residual that depends on the direction.
    """

    name: ClassVar[str] = "asymmetric"
    title: ClassVar[str] = "Coulomb and viscous, each direction apart"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="viscous_positive", symbol="Fv+", unit="N m s/rad"),
        Parameter(name="viscous_negative", symbol="Fv-", unit="N m s/rad"),
        Parameter(name="coulomb_positive", symbol="Fc+", unit="N m"),
        Parameter(name="coulomb_negative", symbol="Fc-", unit="N m"),
    )
    jumps: ClassVar[bool] = True

    def torque(self, velocity: Array, values: Array) -> Array:
        """Compute R(v) [N m], shape (N,)."""
        viscous_positive, viscous_negative, coulomb_positive, coulomb_negative = values
        forward = viscous_positive * velocity + coulomb_positive
        backward = viscous_negative * velocity - coulomb_negative
        return np.where(velocity > 0, forward, np.where(velocity < 0, backward, 0.0))

    def jacobian(self, velocity: Array, values: Array) -> Array:  # noqa: ARG002 - the law is linear
        """Compute dR/d(viscous_positive, viscous_negative, coulomb_positive, coulomb_negative), shape (N, 4)."""
        forward, backward = velocity > 0, velocity < 0
        return np.column_stack([velocity * forward, velocity * backward, 1.0 * forward, -1.0 * backward])
