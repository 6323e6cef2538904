"""Friction torque samples for fits and reports."""

from dataclasses import dataclass

import numpy as np

from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.filters.averaging import Nodes

MOST_KEPT = 60_000
"""Largest number of kept samples. Filtered samples are closer together than they differ, so a fit loses nothing."""


@dataclass(frozen=True, eq=False, kw_only=True)
class FrictionSamples:
    """N samples of the friction torque of n joints, from one or more logs.

    Attributes
    ----------
    joint_names
        Names of the n torque-controlled joints.
    period
        Sampling period of the log [s]; samples may be farther apart.
    time
        Time [s], shape (N,).
    velocity, acceleration, friction_torque
        Motion and friction torque [rad/s], [rad/s^2], [N m], shape (N, n); NaN where the friction torque is unknown.
    usable
        Samples that a fit may use, shape (N, n): the joint's limb swings, or the base is fixed.
    block
        Number of each sample's step or second, shape (N,): samples of one block are correlated.
    support
        Index into `support_names`, shape (N,).
    support_names
        Contact modes, e.g. ("left_foot", "left_foot+right_foot"); ("base",) for a fixed base.
    stride
        Every `stride`-th sample was kept.
    prismatic
        Whether each of the n joints is prismatic, with units m, m/s and N; empty if none is.
    units
        Unit of each joint's torque where it is not N m or N, or ""; empty if none is.
    nodes
        Instants around a sample over which the filter has averaged the friction torque; None without averaging.
    jerk, snap
        Second and third derivative of the velocity over those instants, shape (N, n); None without nodes.
    sharp_velocity
        Velocity filtered with half the window [rad/s], shape (N, n): noisier, but with accurate reversals, for the
        average of a law with state. None without nodes.
    torque
        Measured torque, filtered like the friction torque [N m], shape (N, n); None if not needed.
    """

    joint_names: tuple[str, ...]
    period: float
    time: Array
    velocity: Array
    acceleration: Array
    friction_torque: Array
    usable: BoolArray
    block: IntArray
    support: IntArray
    support_names: tuple[str, ...]
    stride: int = 1
    prismatic: tuple[bool, ...] = ()
    units: tuple[str, ...] = ()
    nodes: Nodes | None = None
    jerk: Array | None = None
    snap: Array | None = None
    sharp_velocity: Array | None = None
    torque: Array | None = None

    def slides(self, column: int) -> bool:
        """Whether the joint of a column is prismatic."""
        return bool(self.prismatic) and self.prismatic[column]

    def torque_unit(self, column: int) -> str:
        """Return the unit of the torque of a column if it is not N m or N, or ""."""
        return self.units[column] if self.units else ""

    def velocity_around(self, column: int, rows: IntArray) -> Array | None:
        """Compute a joint's velocity at the nodes of some samples, shape (rows, K); None without nodes.

        With a lag, the mean over the past is the sample's velocity, because exponential weights have -lag, 2 lag^2 and
        -6 lag^3 as means of s, s^2 and s^3.
        """
        if self.nodes is None or self.jerk is None or self.snap is None:
            return None
        s, lag, index = self.nodes.offsets, self.nodes.lag, (rows, column)
        derivatives = np.stack([self.velocity[index], self.acceleration[index], self.jerk[index], self.snap[index]])
        return np.asarray(
            derivatives.T @ np.stack([np.ones_like(s), s + lag, s * (s / 2 + lag), s * (s**2 / 6 - lag**2)])
        )
