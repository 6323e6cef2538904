"""Coulomb and viscous friction."""

from typing import ClassVar

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.friction.law import FrictionLaw, Parameter
from stribeck.core.friction.parameters import COULOMB, OFFSET, VISCOUS


class CoulombViscous(FrictionLaw):
    """Constant and speed-proportional resistance, (3.1), (3.2) of Egle 2021.

    R(v) = Fv v + Fc sgn(v) + offset, with sgn(0) = 0

    When to use it: first, and whenever the log has too few slow samples to show a Stribeck effect. URDF `<dynamics>`,
    MuJoCo (`frictionloss`, `damping`) and PhysX represent it without loss.
    """

    name: ClassVar[str] = "coulomb-viscous"
    title: ClassVar[str] = "Coulomb and viscous"
    parameters: ClassVar[tuple[Parameter, ...]] = (VISCOUS, COULOMB, OFFSET)
    free_coefficients: ClassVar[tuple[int, ...]] = (2,)
    jumps: ClassVar[bool] = True

    def torque(self, velocity: Array, values: Array) -> Array:
        """Compute R(v) [N m], shape (N,)."""
        viscous, coulomb, offset = values
        return np.asarray(viscous * velocity + coulomb * np.sign(velocity) + offset)

    def jacobian(self, velocity: Array, values: Array) -> Array:  # noqa: ARG002 - the law is linear
        """Compute dR/d(viscous, coulomb, offset), shape (N, 3)."""
        return np.column_stack([velocity, np.sign(velocity), np.ones_like(velocity)])
