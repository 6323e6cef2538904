"""Friction observer over a log: same results as `MomentumObserver`, for many samples at once."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy  # its signal is slow to import: loaded at its first use

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.dynamics.contact.mode import ContactMode
from stribeck.core.dynamics.state import State
from stribeck.core.equations.friction_torque.explained import Explained
from stribeck.core.filters.averaging import MOST_NODES, Nodes
from stribeck.core.log.clock import STEP
from stribeck.core.settings import Settings
from stribeck.paper.observer import decay, loop_momentum_balance

PAST = (1.0, 3.0)
"""Times before a sample, in lags [1], with additional velocities, for the low-pass of a law where the joint reverses.
"""


class _Last(NamedTuple):
    """Last sample of a part of a log, its low-pass output (if any), and the velocities until then."""

    mode: int
    time: float
    signals: Array
    passed: Array | None
    velocities: Array


class LogObserver:
    """Computes friction torques of a log with the friction observer, part by part.

    After a gap or a change of contact mode, the observer starts with the mean over the first sample period instead of
    zero: velocity, acceleration and torque pass the same low-pass from the same start, so there is no transient.

    Parameters
    ----------
    period
        Sampling period [s].
    bandwidth
        Bandwidth of the low-pass [Hz].
    """

    def __init__(self, period: float, bandwidth: float) -> None:
        self._period, self._decay = period, float(decay(bandwidth, period))
        self._nodes = exponential_nodes(self._decay, period)
        self._last: _Last | None = None

    def __call__(
        self,
        modes: tuple[ContactMode, ...],
        mode: IntArray,
        time: Array,
        state: State,
        torque: Array,
        settings: Settings,
    ) -> Explained:
        """Compute low-pass filtered friction torque, velocity, acceleration and torque of samples.

        The acceleration is the change of the filtered velocity. No ground reaction is predicted, because that requires
        accelerations.
        """
        usable = np.zeros(torque.shape, dtype=bool)
        signals = np.empty((4, *torque.shape))
        for k in np.unique(mode):
            rows = np.flatnonzero(mode == k)
            part, contact = state.take(rows), modes[k]
            motion = part.position, part.velocity, contact.root(part)
            momentum, change = loop_momentum_balance(contact.robot, contact.rooted, *motion)
            if contact.leaves_open:
                momentum[:, contact.standing] = np.nan
            signals[:, rows] = momentum, torque[rows] + change, part.velocity, torque[rows]
            usable[rows] = contact.seen(settings)
        passed, past = self._low_pass(mode, time, signals)
        friction, velocity, acceleration, effort = passed
        jerk, snap = self._differentiate(velocity, acceleration, past)
        wrench = np.full((len(torque), 6), np.nan)
        return Explained(friction, usable, wrench, velocity, acceleration, effort, self._nodes, jerk, snap)

    def _low_pass(self, mode: IntArray, time: Array, signals: Array) -> tuple[Array, Array]:
        """Filter signals, shape (4, T, n), and collect past velocities, shape (2, T, n).

        The signals are p, tau + b, v and tau; see `_average_periods`.
        """
        passed, past = np.full_like(signals, np.nan), np.empty((len(PAST), *signals.shape[1:]))
        steps = [lags * self._nodes.lag / self._period for lags in PAST]
        memory = int(steps[-1]) + 2
        breaks = np.flatnonzero((np.diff(mode) != 0) | (np.diff(time) > STEP * self._period)) + 1
        for start, stop in pairwise([0, *breaks.tolist(), len(mode)]):
            run, last = signals[:, start:stop], self._last
            if last and (last.mode != mode[start] or time[start] - last.time > STEP * self._period):
                last = None
            velocities = run[2]
            if last:
                run = np.concatenate([last.signals, run], axis=1)
                velocities = np.concatenate([last.velocities, velocities])
            past[:, start:stop] = [_interpolate_past(velocities, step)[start - stop :] for step in steps]
            means = _average_periods(run, self._period)
            if means.shape[1]:
                before = means[:, :1] if last is None or last.passed is None else last.passed
                share = 1 - self._decay
                after, _ = scipy.signal.lfilter([share], [1, -self._decay], means, axis=1, zi=self._decay * before)
                passed[:, start:stop] = np.concatenate([before, after], axis=1)[:, start - stop :]
            self._last = _Last(
                mode=int(mode[stop - 1]),
                time=float(time[stop - 1]),
                signals=signals[:, stop - 1 : stop],
                passed=passed[:, stop - 1 : stop] if means.shape[1] else None,
                velocities=velocities[-memory:],
            )
        return passed, past

    def _differentiate(self, velocity: Array, acceleration: Array, past: Array) -> Array:
        """Compute jerk and snap such that `FrictionSamples.velocity_around` matches the past velocities."""
        lag = self._nodes.lag
        s = -lag * np.array(PAST)
        matrix = np.column_stack([s * (s / 2 + lag), s * (s**2 / 6 - lag**2)])
        beyond = past - velocity - acceleration * (s + lag)[:, None, None]
        return np.asarray(np.einsum("ij,jtn->itn", np.linalg.inv(matrix), beyond))


def _interpolate_past(values: Array, steps: float) -> Array:
    """Interpolate values some samples ago, shape (T, n); before the first sample, the first value."""
    whole = int(steps)
    rows = np.arange(len(values)) - whole
    share = steps - whole
    return np.asarray((1 - share) * values[np.maximum(rows, 0)] + share * values[np.maximum(rows - 1, 0)])


def _average_periods(signals: Array, period: float) -> Array:
    """Compute means over the sample periods between samples, shape (4, T - 1, n): R, v, v' and tau.

    The inputs are momentum, tau + b, velocity and torque, shape (4, T, n).
    """
    momentum, drive, velocity, torque = signals
    mean = [(signal[1:] + signal[:-1]) / 2 for signal in (drive, velocity, torque)]
    return np.stack(
        [mean[0] - np.diff(momentum, axis=0) / period, mean[1], np.diff(velocity, axis=0) / period, mean[2]]
    )


def exponential_nodes(decay: float, period: float) -> Nodes:
    """Compute the nodes of a first-order low-pass that decays by the factor `decay` per sample.

    Its exponential weights on the past are split into equal shares, each at its own mean. The mean of all shares is the
    lag, `h / 2 + h d / (1 - d)`, because samples are means over periods.
    """
    lag = period * (0.5 + decay / (1 - decay))
    ends = -np.log1p(-np.arange(MOST_NODES) / MOST_NODES)
    beyond = np.append((1 + ends) * np.exp(-ends), 0.0)  # integral of x e^-x from each end
    return Nodes(lag * MOST_NODES * np.diff(beyond), np.full(MOST_NODES, 1 / MOST_NODES), 0, lag)
