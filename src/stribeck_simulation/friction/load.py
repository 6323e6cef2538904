"""Friction that grows with the torque a gear carries."""

from collections.abc import Sequence

import numpy as np

from stribeck.friction import Parameter
from stribeck.typing import Array
from stribeck_simulation.friction.injection import Instant
from stribeck_simulation.friction.law import SLOWEST
from stribeck_simulation.friction.parameters import Parameters, parameter_table


class Load:
    """Coulomb friction in proportion to the joint's torque, on top of any other.

        R = eta |tau| tanh(s v)

    Teeth rub the more the harder they are pressed together: a gear loses a share eta of what it carries, whichever way
    it turns (Hamon, Gautier and Garrec 2010, "Dynamic identification of robots with a dry friction model depending on
    load and velocity", IROS). The step takes the secant: D = eta |tau| tanh(s v) / v and c = 0, so that no energy is
    added.

    Parameters
    ----------
    joint_names
        The robot's.
    parameters
        By joint and name, see `PARAMETERS`; joints that are left out have none of it.

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
        """Return D and c of these joints, shape (k,) each."""
        share, slope = self._values
        speed = np.maximum(np.abs(instant.velocity[self.columns]), SLOWEST)
        level = share * np.abs(instant.torque[self.columns])
        return level * np.tanh(slope * speed) / speed, np.zeros(len(self.columns))

    def advance(self, velocity: Array) -> None:
        """Do nothing: it has no state."""
