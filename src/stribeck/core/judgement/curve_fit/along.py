"""Motion along which a law with state is evaluated, and the filter that is applied to its friction."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy  # ndimage is slow to import and loaded on first use

from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.friction.law import Motion
from stribeck.core.judgement.speed import top_speed
from stribeck.core.result.samples import FrictionSamples

FORGOTTEN = 0.05
"""Path divided by the top speed [s] after which the initial state of a joint is forgotten.

It is 5/3 of the longest travel from which a fit starts.
"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Along:
    """Positions of N samples of a joint in its motion of M samples.

    Attributes
    ----------
    motion
        Motion of all samples with a velocity, whether they are fitted or not.
    rows
        Rows of the N samples in the motion, shape (N,).
    kernel
        Weights by which the filter averages the torque over adjacent samples, shape (2 r + 1,).
    """

    motion: Motion
    rows: IntArray
    kernel: Array

    @cached_property
    def _padded(self) -> tuple[IntArray, IntArray]:
        """Rows of the motion with the ends of pieces repeated r times, and positions of the N samples in them."""
        reach, count = len(self.kernel) // 2, len(self.motion.velocity)
        ends = self.motion.begins.astype(np.int64)
        repeats = 1 + reach * (ends + np.append(ends[1:], 1))
        first = np.cumsum(repeats) - repeats
        return np.repeat(np.arange(count), repeats), (first + reach * ends)[self.rows]

    def average(self, torque: Array) -> Array:
        """Average values along the motion, shape (M, ...), with the filter's weights at the N samples, shape (N, ...).

        Values are constant beyond the ends of a piece.
        """
        if len(self.kernel) == 1:
            return torque[self.rows]
        layout, rows = self._padded
        return np.asarray(scipy.ndimage.correlate1d(torque[layout], self.kernel, axis=0, mode="nearest")[rows])

    def take(self, rows: slice | BoolArray | IntArray) -> Along:
        """Select some of the N samples."""
        return replace(self, rows=self.rows[rows])

    @cached_property
    def unresolved(self) -> float:
        """Path after a reversal within half of the filter's window, or one sample [rad], [m].

        Median over all reversals; NaN without reversals.
        """
        velocity, half = self.motion.velocity, max(len(self.kernel) // 2, 1) * self.motion.period
        turns = np.flatnonzero((velocity[:-1] * velocity[1:] < 0) & ~self.motion.begins[1:])
        if not len(turns):
            return float("nan")
        return float(np.median(np.abs(np.diff(velocity)[turns])) / self.motion.period * half**2 / 2)


def along(samples: FrictionSamples, column: int, rows: IntArray) -> Along:
    """Find the positions of a joint's samples in its motion."""
    velocity, begins = _motion(samples, column)
    period = samples.period * samples.stride
    return Along(motion=Motion(velocity=velocity, period=period, begins=begins), rows=rows, kernel=_kernel(samples))


def state_known(samples: FrictionSamples, column: int, rest: float) -> BoolArray:
    """Find the samples before which a joint has moved far enough to forget its initial state, shape (N,).

    Speeds below `rest` times the top speed are noise and do not count as motion.
    """
    velocity, begins = _motion(samples, column)
    speed, top = np.abs(velocity), top_speed(velocity)
    moved = np.cumsum(np.where(speed >= rest * top, speed, 0.0)) * samples.period * samples.stride
    first = np.flatnonzero(begins)[np.cumsum(begins) - 1]
    return np.asarray(moved - moved[first] >= FORGOTTEN * top)


def _motion(samples: FrictionSamples, column: int) -> tuple[Array, BoolArray]:
    """Collect the velocity of all samples [rad/s] and mark those after an interruption, shape (N,)."""
    source = samples.velocity if samples.sharp_velocity is None else samples.sharp_velocity
    period = samples.period * samples.stride
    begins = np.abs(np.diff(samples.time, prepend=-np.inf) / period - 1) > 0.5
    return np.ascontiguousarray(source[:, column], dtype=np.float64), begins


def _kernel(samples: FrictionSamples) -> Array:
    """Convert the filter's weights to weights of adjacent samples by linear interpolation."""
    nodes = samples.nodes
    if nodes is None:
        return np.ones(1)
    places = nodes.offsets / (samples.period * samples.stride)
    reach = int(np.ceil(np.abs(places).max() - 1e-9))
    near = np.maximum(1 - np.abs(places - np.arange(-reach, reach + 1)[:, None]), 0.0)
    return np.asarray(near @ nodes.weights)
