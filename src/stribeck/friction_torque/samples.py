"""Friction torque samples, as the fit and the report take them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.differentiation.averaging import Nodes


@dataclass(frozen=True, eq=False, kw_only=True)
class FrictionSamples:
    """N samples of the friction torque of n joints, kept from one log or several.

    Attributes
    ----------
    joint_names
        The n torque-controlled joints.
    period
        Sampling period of the log [s]; samples kept may be further apart.
    time
        [s], shape (N,).
    velocity, acceleration, friction_torque
        [rad/s], [rad/s^2], [N m], shape (N, n); NaN where the friction torque is not known.
    usable
        Which samples a fit may use, shape (N, n): the joint's limb swings, or the base is fixed.
    block
        Number of the step or second a sample belongs to, shape (N,): samples of one block are correlated.
    support
        Index into `support_names`, shape (N,).
    support_names
        E.g. ("left_foot", "left_foot+right_foot"); ("base",) for a fixed base.
    stride
        One of this many samples was kept.
    prismatic
        Which of the n joints slide, in m, m/s and N; empty if none does.
    nodes
        Instants around a sample over which the filter has averaged the friction torque; none if None.
    jerk, snap
        Second and third derivative of the velocity over those instants, shape (N, n); None without nodes.
    sharp_velocity
        Through half of the filter's window [rad/s], shape (N, n): noisier, but it shows reversals as they are, of which
        a law with state makes its own average. None without nodes.
    torque
        Measured, filtered as the friction torque is [N m], shape (N, n); None where nobody asks for it.
    """

    joint_names: tuple[str, ...]
    period: float
    time: Array
    velocity: Array
    acceleration: Array
    friction_torque: Array
    usable: NDArray[np.bool_]
    block: NDArray[np.int64]
    support: NDArray[np.int64]
    support_names: tuple[str, ...]
    stride: int = 1
    prismatic: tuple[bool, ...] = ()
    nodes: Nodes | None = None
    jerk: Array | None = None
    snap: Array | None = None
    sharp_velocity: Array | None = None
    torque: Array | None = None

    def slides(self, column: int) -> bool:
        """Whether the joint of a column is prismatic."""
        return bool(self.prismatic) and self.prismatic[column]

    def velocity_around(self, column: int, rows: NDArray[np.int64]) -> Array | None:
        """Return a joint's velocity at the nodes of some samples, shape (rows, K); None without nodes.

        With a lag, the mean over the past is the sample's velocity, as exponential weights have -lag, 2 lag^2 and
        -6 lag^3 for means of s, s^2 and s^3.
        """
        if self.nodes is None or self.jerk is None or self.snap is None:
            return None
        s, lag, here = self.nodes.offsets, self.nodes.lag, (rows, column)
        derivatives = np.stack([self.velocity[here], self.acceleration[here], self.jerk[here], self.snap[here]])
        return np.asarray(
            derivatives.T @ np.stack([np.ones_like(s), s + lag, s * (s / 2 + lag), s * (s**2 / 6 - lag**2)])
        )
