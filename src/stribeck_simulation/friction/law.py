"""Friction by one of the library's laws."""

from collections.abc import Sequence

import numpy as np

from stribeck.friction import FrictionLaw
from stribeck.typing import Array
from stribeck_simulation.friction.drift import Drift
from stribeck_simulation.friction.injection import Instant
from stribeck_simulation.friction.parameters import Parameters, parameter_table
from stribeck_simulation.span import span

SLOWEST = 1e-4
"""Slower joints have the secant of this velocity [rad/s or m/s]; laws that jump at standstill are steep but finite."""


class LawFriction:
    """Friction R(v) of a law, by its secant: D = (R(v) - R(0)) / v and c = R(0).

    As R(v) - R(0) dissipates, D is never negative, so a step with implicit damping never adds energy, however steep
    the law.

    Parameters
    ----------
    joint_names
        The robot's.
    law
        Of the library.
    parameters
        By joint and name; joints that are left out have no friction.
    drift
        How the parameters change over the run.

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
        """Return the parameters at a time [s], shape (p, k)."""
        return self._values if self._drift is None else self._values * self._drift.factors(self._names, time)[:, None]

    def linearise(self, instant: Instant) -> tuple[Array, Array]:
        """Return D and c of these joints, shape (k,) each."""
        values = self.values(instant.time)
        speed = instant.velocity[self._read]
        speed = np.copysign(np.maximum(np.abs(speed), SLOWEST), speed)
        still = self._law.torque(np.zeros_like(speed), values) if self._drift else self._still
        return np.maximum((self._law.torque(speed, values) - still) / speed, 0.0), still

    def advance(self, velocity: Array) -> None:
        """Do nothing: the law has no state."""
