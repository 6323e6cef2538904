"""Friction according to a law of the library, and friction proportional to the torque in a gear."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError
from stribeck.core.friction import FrictionLaw, Parameter
from stribeck.simulation.friction.injection import Instant
from stribeck.simulation.friction.parameters import Parameters, parameter_table
from stribeck.simulation.span import span


@dataclass(frozen=True)
class Drift:
    """Warm-up of parameters, like a body with constant heating: 1 + (ratio - 1) (1 - exp(-t / T)).

    Viscous friction of a gear falls to about a half between 30 and 80 deg C, Coulomb friction changes little
    (Bittencourt and Gunnarsson 2012, "Static friction in a robot joint", J. Dyn. Sys., Meas., Control 134(5)).

    Attributes
    ----------
    ratios
        Warm value divided by cold value [1], by parameter; other parameters are constant.
    time_constant
        Time constant T [s].
    """

    ratios: Mapping[str, float]
    time_constant: float

    def require(self, names: Sequence[str], law: str) -> None:
        """Check that ratios refer to parameters of the law, and that ratios and times are positive.

        Raises
        ------
        SettingsError
            For the first invalid entry.
        """
        for name, ratio in self.ratios.items():
            if name not in names:
                raise SettingsError(f"drift: law '{law}' has no parameter '{name}'; it has {', '.join(names)}")
            if not 0 < ratio < np.inf:
                raise SettingsError(f"drift: ratio of {name} is {ratio}; expected a positive number")
        if not 0 < self.time_constant < np.inf:
            raise SettingsError(f"drift: time_constant is {self.time_constant}; expected a positive number of seconds")

    def factors(self, names: Sequence[str], time: float) -> Array:
        """Compute the factor of each parameter at a time [s], shape (p,)."""
        warm = 1.0 - np.exp(-time / self.time_constant)
        return np.array([1.0 + (self.ratios.get(name, 1.0) - 1.0) * warm for name in names])


SLOWEST = 1e-4
"""Smallest velocity for a secant [rad/s or m/s]; it keeps laws with a jump at standstill finite."""


class LawFriction:
    """Friction R(v) of a law, by its secant: D = (R(v) - R(0)) / v and c = R(0).

    R(v) - R(0) dissipates energy, therefore D is never negative, and a step with implicit damping adds no energy even
    if the law is steep.

    Parameters
    ----------
    joint_names
        Joints of the robot.
    law
        Law of the library.
    parameters
        Parameters by joint and name; other joints have no friction.
    drift
        Change of the parameters during the run.

    Raises
    ------
    SettingsError
        If a joint or parameter is unknown, missing or out of bounds.
    """

    def __init__(
        self, joint_names: Sequence[str], law: FrictionLaw, parameters: Parameters, drift: Drift | None = None
    ) -> None:
        self.columns, self._values = parameter_table(joint_names, law.name, law.parameters, parameters)
        self.parameters = parameters
        self._law, self._drift, self._read = law, drift, span(self.columns)
        self._names = [parameter.name for parameter in law.parameters]
        if drift:
            drift.require(self._names, law.name)
        self._still = law.torque(np.zeros(len(self.columns)), self._values)

    def values(self, time: float) -> Array:
        """Compute the parameters at a time [s], shape (p, k)."""
        return self._values if self._drift is None else self._values * self._drift.factors(self._names, time)[:, None]

    def linearise(self, instant: Instant) -> tuple[Array, Array]:
        """Compute D and c of these joints, shape (k,) each."""
        values = self.values(instant.time)
        speed = instant.velocity[self._read]
        speed = np.copysign(np.maximum(np.abs(speed), SLOWEST), speed)
        still = self._law.torque(np.zeros_like(speed), values) if self._drift else self._still
        return np.maximum((self._law.torque(speed, values) - still) / speed, 0.0), still

    def advance(self, velocity: Array) -> None:
        """Do nothing: the law has no state."""


class Load:
    """Coulomb friction proportional to the joint's torque, in addition to other friction.

        R = eta |tau| tanh(s v)

    Friction between teeth grows with the force between them: a gear loses a share eta of its load in both directions
    (Hamon, Gautier and Garrec 2010, "Dynamic identification of robots with a dry friction model depending on load and
    velocity", IROS). The step uses the secant, D = eta |tau| tanh(s v) / v and c = 0, and adds no energy.

    Parameters
    ----------
    joint_names
        Joints of the robot.
    parameters
        Parameters by joint and name, see `PARAMETERS`; other joints have no such friction.

    Raises
    ------
    SettingsError
        If a joint or parameter is unknown, missing or out of bounds.
    """

    PARAMETERS = (
        Parameter(name="load_share", symbol="eta", unit="1", upper=1.0),
        Parameter(name="load_slope", symbol="s", unit="s/rad", lower=1e-4),
    )

    def __init__(self, joint_names: Sequence[str], parameters: Parameters) -> None:
        self.columns, self._values = parameter_table(joint_names, "load", self.PARAMETERS, parameters)
        self.parameters = parameters

    def linearise(self, instant: Instant) -> tuple[Array, Array]:
        """Compute D and c of these joints, shape (k,) each."""
        share, slope = self._values
        speed = np.maximum(np.abs(instant.velocity[self.columns]), SLOWEST)
        level = share * np.abs(instant.torque[self.columns])
        return level * np.tanh(slope * speed) / speed, np.zeros(len(self.columns))

    def advance(self, velocity: Array) -> None:
        """Do nothing: the effect has no state."""
