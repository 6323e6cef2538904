"""LuGre friction: bristles that bend before they slip."""

from collections.abc import Sequence

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.friction import Parameter
from stribeck.simulation.friction.injection import Instant
from stribeck.simulation.friction.parameters import Parameters, parameter_table


class LuGre:
    """Dynamic friction with presliding, hysteresis and breakaway (Canudas de Wit et al. 1995).

        z' = v - s0 |v| / g(v) z,   g(v) = Fc (1 + S exp(-(v / vs)^2))
        R = s0 z + s1 z' + Fv v + offset

    In steady sliding, R = Fv v + g(v) sgn(v) + offset, which is the law "stribeck-exponent" with exponent 2. The step
    is implicit in bristle deflection z and velocity u: with k = 1 / (1 + h s0 |v| / g), z_next = k (z + h u), therefore
    D = k (s0 h + s1) + Fv and c = k (s0 + s1 / h) z - s1 z / h + offset.

    Parameters
    ----------
    joint_names
        Joints of the robot.
    parameters
        Parameters by joint and name, see `PARAMETERS`; other joints have no friction.

    Raises
    ------
    SettingsError
        If a joint or parameter is unknown, missing or out of bounds.
    """

    PARAMETERS = (
        Parameter(name="bristle_stiffness", symbol="s0", unit="N m/rad", lower=1e-9),
        Parameter(name="bristle_damping", symbol="s1", unit="N m s/rad"),
        Parameter(name="viscous", symbol="Fv", unit="N m s/rad"),
        Parameter(name="coulomb", symbol="Fc", unit="N m", lower=1e-9),
        Parameter(name="stribeck_gain", symbol="S", unit="1"),
        Parameter(name="stribeck_velocity", symbol="vs", unit="rad/s", lower=1e-4),
        Parameter(name="offset", symbol="tau_os", unit="N m", lower=-np.inf),
    )

    def __init__(self, joint_names: Sequence[str], parameters: Parameters) -> None:
        self.columns, self._values = parameter_table(joint_names, "lugre", self.PARAMETERS, parameters)
        self.parameters = parameters
        self.deflection = np.zeros(len(self.columns))
        self._shrink = np.ones(len(self.columns))
        self._step = 0.0

    def linearise(self, instant: Instant) -> tuple[Array, Array]:
        """Compute D and c of these joints, shape (k,) each."""
        s0, s1, Fv, Fc, S, vs, offset = self._values
        v, h, z = instant.velocity[self.columns], instant.step, self.deflection
        level = Fc * (1.0 + S * np.exp(-((v / vs) ** 2)))
        self._shrink, self._step = 1.0 / (1.0 + h * s0 * np.abs(v) / level), h
        damping = self._shrink * (s0 * h + s1) + Fv
        return damping, self._shrink * (s0 + s1 / h) * z - s1 * z / h + offset

    def advance(self, velocity: Array) -> None:
        """Bend the bristles by the step's velocity."""
        self.deflection = self._shrink * (self.deflection + self._step * velocity)
