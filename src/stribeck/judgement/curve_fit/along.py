"""The motion along which a law with state is fitted, and the filter that its friction passes like the samples."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy  # its ndimage is slow to import: loaded at its first use
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.friction.law import Motion
from stribeck.friction_torque.samples import FrictionSamples
from stribeck.judgement.speed import top_speed

FORGOTTEN = 0.05
"""Path over the top speed [s] after which a joint's state no longer shows how it began.

It is the longest travel that a fit starts from, and two thirds of it more.
"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Along:
    """Where N samples of a joint lie in its motion of M samples.

    Attributes
    ----------
    motion
        Of all samples with a velocity, also those that are not fitted.
    rows
        Of the N samples in it, shape (N,).
    kernel
        Weights of the samples of the motion around each, as the filter has averaged the torque, shape (2 r + 1,).
    """

    motion: Motion
    rows: NDArray[np.int64]
    kernel: Array

    @cached_property
    def _padded(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Samples of the motion with those at the ends of pieces repeated r times, and where in it the N lie."""
        reach, count = len(self.kernel) // 2, len(self.motion.velocity)
        ends = self.motion.begins.astype(np.int64)
        repeats = 1 + reach * (ends + np.append(ends[1:], 1))
        first = np.cumsum(repeats) - repeats
        return np.repeat(np.arange(count), repeats), (first + reach * ends)[self.rows]

    def average(self, torque: Array) -> Array:
        """Return values along the motion, shape (M, ...), as the filter averages them at the N samples, shape (N, ...).

        Beyond the ends of a piece they are taken to be what they are there.
        """
        if len(self.kernel) == 1:
            return torque[self.rows]
        layout, rows = self._padded
        return np.asarray(scipy.ndimage.correlate1d(torque[layout], self.kernel, axis=0, mode="nearest")[rows])

    def take(self, rows: slice | NDArray[np.bool_] | NDArray[np.int64]) -> Along:
        """Return where these of the N samples lie."""
        return replace(self, rows=self.rows[rows])

    @cached_property
    def unresolved(self) -> float:
        """Path from a reversal on that half of the filter's window, or a sample, averages over [rad], [m].

        The median of all reversals; NaN without any.
        """
        velocity, half = self.motion.velocity, max(len(self.kernel) // 2, 1) * self.motion.period
        turns = np.flatnonzero((velocity[:-1] * velocity[1:] < 0) & ~self.motion.begins[1:])
        if not len(turns):
            return float("nan")
        return float(np.median(np.abs(np.diff(velocity)[turns])) / self.motion.period * half**2 / 2)


def along(samples: FrictionSamples, column: int, rows: NDArray[np.int64]) -> Along:
    """Return where samples of a joint lie in its motion."""
    velocity, begins = _motion(samples, column)
    period = samples.period * samples.stride
    return Along(motion=Motion(velocity=velocity, period=period, begins=begins), rows=rows, kernel=_kernel(samples))


def state_known(samples: FrictionSamples, column: int, rest: float) -> NDArray[np.bool_]:
    """Return at which samples a joint has moved so far that its state before does not matter, shape (N,).

    `rest` is a share of its top speed; what is slower is noise, and no motion.
    """
    velocity, begins = _motion(samples, column)
    speed, top = np.abs(velocity), top_speed(velocity)
    moved = np.cumsum(np.where(speed >= rest * top, speed, 0.0)) * samples.period * samples.stride
    first = np.flatnonzero(begins)[np.cumsum(begins) - 1]
    return np.asarray(moved - moved[first] >= FORGOTTEN * top)


def _motion(samples: FrictionSamples, column: int) -> tuple[Array, NDArray[np.bool_]]:
    """Return the velocity of all samples [rad/s], and which begin a piece, as time breaks off before, shape (N,)."""
    source = samples.velocity if samples.sharp_velocity is None else samples.sharp_velocity
    period = samples.period * samples.stride
    begins = np.abs(np.diff(samples.time, prepend=-np.inf) / period - 1) > 0.5
    return np.ascontiguousarray(source[:, column], dtype=np.float64), begins


def _kernel(samples: FrictionSamples) -> Array:
    """Return the weights of neighbouring samples that stand for the filter's, by linear interpolation between them."""
    nodes = samples.nodes
    if nodes is None:
        return np.ones(1)
    places = nodes.offsets / (samples.period * samples.stride)
    reach = int(np.ceil(np.abs(places).max() - 1e-9))
    near = np.maximum(1 - np.abs(places - np.arange(-reach, reach + 1)[:, None]), 0.0)
    return np.asarray(near @ nodes.weights)
