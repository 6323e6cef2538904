"""Backlash between torque sensor and link, as in the parallel bar that drives TORO's ankle pitch."""

from collections.abc import Sequence

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.friction import Parameter
from stribeck.simulation.friction.injection import Instant
from stribeck.simulation.friction.parameters import Parameters, parameter_table


class Backlash:
    """A light, damped bar with play: the sensor's torque pushes the bar, which pushes the link at the end of the play.

        d y' = tau - T,   T = k dz(y - q),   R = tau - T

    with the bar's angle y, the joint's angle q, and the dead zone dz of half the play on both sides. While the bar
    crosses the play, no torque reaches the link. In contact, the spring k transmits the torque, and R is the loss in
    the bar's damping d (Nordin and Gutman 2002, "Controlling mechanical systems with backlash: a survey"). The step is
    implicit: in contact, T_next = k (d / h (y - q_next - s) + tau) / (d / h + k), with half the play s on this side,
    is linear in the step's velocity.

    Parameters
    ----------
    joint_names
        Joints of the robot.
    parameters
        Parameters by joint and name, see `PARAMETERS`; other joints have no play.

    Raises
    ------
    SettingsError
        If a joint or parameter is unknown, missing or out of bounds.
    """

    PARAMETERS = (
        Parameter(name="play", symbol="2 b", unit="rad"),  # total, from side to side
        Parameter(name="stiffness", symbol="k", unit="N m/rad", lower=1e-9),
        Parameter(name="damping", symbol="d", unit="N m s/rad", lower=1e-9),
    )

    def __init__(self, joint_names: Sequence[str], parameters: Parameters) -> None:
        self.columns, self._values = parameter_table(joint_names, "backlash", self.PARAMETERS, parameters)
        self.parameters = parameters
        self._bar: Array | None = None
        self._last: tuple[Array, ...] = ()

    def linearise(self, instant: Instant) -> tuple[Array, Array]:
        """Compute D and c of these joints, shape (k,) each."""
        play, k, d = self._values
        h, state = instant.step, (instant.position, instant.velocity, instant.torque)
        q, v, torque = (values[self.columns] for values in state)
        bar = q.copy() if self._bar is None else self._bar
        free = bar + h * torque / d  # next position of the bar without contact
        gap = free - (q + h * v)
        side = np.where(np.abs(gap) > play / 2, np.sign(gap), 0.0)
        closed, ratio = side != 0, k / (d / h + k)
        self._last = (q, bar, torque, side, np.asarray(h))
        transmitted = ratio * (d / h * (bar - q - side * play / 2) + torque)  # T_next if the joint stood still
        return np.where(closed, ratio * d, 0.0), np.where(closed, torque - transmitted, torque)

    def advance(self, velocity: Array) -> None:
        """Move the bar."""
        play, k, d = self._values
        q, bar, torque, side, h = self._last
        edge = q + h * velocity + side * play / 2
        pushed = (d / h * bar + torque + k * edge) / (d / h + k)
        self._bar = np.where(side != 0, pushed, bar + h * torque / d)
