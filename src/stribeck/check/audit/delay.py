"""Delay, low-pass filter or another clock of the torques relative to the motion: the hypothesis that fits best."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.ndimage import uniform_filter1d

from stribeck.check.audit.evidence import BIN, AuditData, Run
from stribeck.check.audit.regression import friction_shapes
from stribeck.core.base.finding import Finding, Setting
from stribeck.core.base.typing import Array

SHORT, LONGEST = 0.03, 2.0
"""Largest lag that is found per joint, and largest delay of all torques [s]."""
LEAST = 1.5
"""Smallest delay that is reported [samples]."""


@dataclass(frozen=True)
class Lag:
    """Lag of a joint's torque: its delay [s], None if unclear; or the time constant of its filter [s].

    The evidence is half of the decrease of chi^2 if a filter replaces the best delay.
    """

    delay: float | None
    constant: float
    evidence: float


@dataclass(frozen=True, eq=False)
class _Timing:
    """Mean torques over the bins at other times, regressed on friction and on the model's torque in the bins.

    Bins with several standing feet are left out, because the model's torque there depends on the measured one.

    Attributes
    ----------
    sums, edges
        Integral of each joint's torque up to the edges of its samples, and the edges [s].
    times, shapes
        Centers of the bins [s], and friction shapes and the model's torque there, of each joint.
    """

    sums: list[Array]
    edges: Array
    times: list[Array]
    shapes: list[Array]

    @classmethod
    def of(cls, evidence: AuditData, last: float) -> "_Timing":
        """Collect the bins of moving joints, up to a time since the log's start [s]."""
        log, period = evidence.prepared.log, evidence.prepared.sampling.period
        size = max(1, round(BIN / period))
        time = log.time[evidence.rows] + ((size - evidence.stride) / 2 - size // 2) * period  # means of thinned rows
        closed = np.array(["+" in name for name in evidence.support_names], dtype=bool)[evidence.support]
        used = (time - log.time[0] < last) & ~closed
        found = cls([], np.append(log.time, log.time[-1] + period) - period / 2, [], [])
        for k, column in enumerate(evidence.robot.torque_controlled):
            rows = np.flatnonzero(used & np.isfinite(evidence.model[:, k]))
            if evidence.moves(k) and len(rows) > 100:
                found.sums.append(np.append(0.0, np.cumsum(log.torque[:, column]) * period))
                found.times.append(time[rows])
                found.shapes.append(np.column_stack([friction_shapes(evidence, k, rows), evidence.model[rows, k]]))
        return found

    def torque(self, k: int, clock: float = 0.0, delay: float = 0.0) -> Array:
        """Compute a joint's mean torque over the bins, with a relative error of its clock [1] and a delay [s]."""
        now = self.edges[0] + (self.times[k] - self.edges[0]) * (1 + clock) + delay
        ends = (np.interp(now + side * BIN / 2, self.edges, self.sums[k]) for side in (1, -1))
        return np.asarray(next(ends) - next(ends)) / BIN

    def left(self, bases: list[Array], clock: float = 0.0, delay: float = 0.0) -> Array:
        """Compute the share of each torque's variance that orthonormal bases leave unexplained, shape (k,)."""
        torques = (self.torque(k, clock, delay) for k in range(len(bases)))
        shares = [_unexplained(base, y) / max(len(y) * y.var(), 1e-300) for base, y in zip(bases, torques, strict=True)]
        return np.maximum(shares, 1e-12)


def delays(evidence: AuditData) -> dict[str, Lag]:
    """Estimate the lag of each joint's torque; joints with a too poor fit of the model have none."""
    lags = {name: _lag(evidence, k) for k, name in enumerate(evidence.joints)}
    return {name: lag for name, lag in lags.items() if lag is not None}


def check_delay(evidence: AuditData, lags: dict[str, Lag]) -> list[Finding]:
    """Report low-pass filters, running means, another clock, or a delay of more than a sample or two.

    A short delay is reported if at least three joints (or all of a smaller robot) have one, and 60 % of them agree, or
    75 % of fewer than eight.
    """
    period = evidence.prepared.sampling.period
    shortest, sure = 0.01, 30.0  # time constant of a filter [s] and evidence [1] from which it replaces a delay
    slow = {name: lag for name, lag in lags.items() if lag.constant > shortest}
    if 2 * len(slow) > len(lags) and sum(lag.evidence for lag in slow.values()) > sure:
        constant = float(np.median([lag.constant for lag in slow.values()]))
        return [Finding.of("torque-filtered", evidence.joints, cutoff=1 / (2 * np.pi * constant))]
    if other := _other_times(evidence):
        return other
    values = np.array([lag.delay for lag in lags.values() if lag.delay is not None])
    if len(values) < max(2, min(3, len(evidence.joints))):
        return []
    middle = float(np.median(values))
    agreeing = int(np.sum(np.abs(values - middle) < max(0.35 * abs(middle), 0.5 * period)))
    error = 1.25 * 1.48 * float(np.median(np.abs(values - middle))) / np.sqrt(len(values))  # standard error of a median
    needed = (0.6 if len(values) >= 8 else 0.75) * len(values)
    if abs(middle) < max(LEAST * period, 4.0 * error) or agreeing < max(2.0, needed):
        return []
    return [_late(evidence, "torque-delay", middle, len(values), agreeing)]


def _other_times(evidence: AuditData) -> list[Finding]:
    """Report another clock of the torques, a long delay, or running means, if one fits far better than none of them."""
    compared, largest = 20.0, 0.02  # part of the log that is compared [s], and largest relative error of a clock [1]
    timing = _Timing.of(evidence, compared)
    bases = [np.linalg.qr(shapes)[0] for shapes in timing.shapes]
    if len(bases) < 2:
        return []

    def best(candidates: Array, apart: float, left: Callable[[float], Array]) -> tuple[float, Array]:
        """Choose the candidate that fits best, refined between its neighbors at a distance."""
        for near in (apart, apart / 5, 0.0):
            shares = [left(value) for value in candidates]
            number = int(np.argmin(np.mean(np.log(shares), axis=1)))
            chosen, share = float(candidates[number]), shares[number]
            candidates = chosen + near * np.linspace(-1, 1, 9)
        return chosen, share

    duration = evidence.prepared.log.time[-1] - evidence.prepared.log.time[0]
    reach, longest = min(compared, duration), min(LONGEST, duration / 8)
    plain = min((timing.left(bases, delay=delay) for delay in np.linspace(-SHORT, SHORT, 7)), key=np.median)
    clocks, late = np.arange(-largest, largest, 0.02 / reach), np.arange(-longest, longest, 0.02)
    clock, of_clock = best(clocks, 0.02 / reach, lambda clock: timing.left(bases, clock=clock))
    delay, of_delay = best(late, 0.02, lambda delay: timing.left(bases, delay=delay))
    if np.median(np.minimum(of_clock, of_delay)) > 0.5 * np.median(plain):
        return []
    if np.median(of_clock) < np.median(of_delay):
        faster, speed = 100 * abs(clock), "fast" if clock > 0 else "slow"
        return [Finding.of("torque-clock", faster=faster, speed=speed)] if abs(clock) > 0.03 / reach else []
    agreeing = int(np.sum(of_delay < 0.5 * plain))
    if not SHORT < abs(delay) < 0.95 * longest or agreeing < max(2.0, 0.6 * len(plain)):
        return []
    mean = round(2 * abs(delay) / BIN)
    smooth = [np.linalg.qr(uniform_filter1d(shapes, mean, axis=0))[0] for shapes in timing.shapes]
    if delay > 0 and np.median(timing.left(smooth, delay=delay)) < 0.5 * np.median(of_delay):
        return [Finding.of("torque-filtered.mean", length=2e3 * delay)]
    return [_late(evidence, "torque-delay.long", delay, len(plain), agreeing)]


def _late(evidence: AuditData, check: str, delay: float, count: int, agreeing: int) -> Finding:
    """Report a delay of the torques [s] with the setting that corrects it."""
    setting = Setting("log.torque", "delay", round(evidence.robot.log_table.torque.delay + delay, 5))
    return Finding.of(check, delay=1e3 * delay, count=count, agreeing=agreeing, settings=[setting])


def _lag(evidence: AuditData, k: int) -> Lag | None:
    """Estimate the lag of a joint's torque; None if the model explains too little of the torque.

    For every shift, the torque is regressed on the model's torque, the velocity, smoothed signs of it and a constant,
    so that friction does not look like a delay. A parabola through the best shift and its neighbors gives the fraction
    of a sample. A delay that explains less than 10 % of the residual is rejected, because model errors look similar.
    A low-pass filter of first order with the time constant T is undone: the torque before it is y + T dy/dt.
    """
    if not evidence.moves(k):
        return None
    period = evidence.prepared.sampling.period
    reach = max(5, round(0.03 / period))  # 30 ms to either side
    shortest = 2 * reach + max(16, 0.3 / period)  # shorter runs give little information on a delay
    runs = _known(evidence, k, shortest)
    if not runs:
        return None
    stride = evidence.stride
    edge = -(-reach // stride)  # shifts stay within a run
    most = 6000  # compared samples of each joint [1]; shifts between them are at the log's rate
    every = -(-sum(len(run.model) for run in runs) // most)
    rows = [np.arange(edge, len(run.model) - edge, every) for run in runs]
    both = list(zip(runs, rows, strict=True))
    speed = np.concatenate([run.velocity[row] for run, row in both])
    model = np.concatenate([run.model[row] for run, row in both])
    torque = np.concatenate([sliding_window_view(run.torque, 2 * reach + 1)[stride * row - reach] for run, row in both])
    top = max(float(np.abs(speed).max()), 1e-9)
    signs = [np.tanh(speed / (share * top)) for share in (0.01, 0.03, 0.1, 0.3)]
    without_model = np.linalg.qr(np.column_stack([np.ones(len(speed)), speed, *signs]))[0]
    with_model = np.linalg.qr(np.column_stack([without_model, model]))[0]
    residual = _unexplained(with_model, torque)
    best = int(np.argmin(residual))
    apart = max(1, round(0.005 / period))
    rate = (torque[:, reach + apart] - torque[:, reach - apart]) / (2 * apart * period)
    constant = -np.linalg.lstsq(np.column_stack([with_model, rate]), torque[:, reach], rcond=None)[0][-1]
    behind = _unexplained(with_model, torque[:, reach] + constant * rate)
    whole = _unexplained(without_model[:, :1], torque)
    gained = _unexplained(without_model, torque[:, best]) - residual[best]
    if not gained > 0.5 * whole[best]:
        return None
    independent = len(torque) * stride * period / 0.05  # the model is filtered
    gain = 0.5 * independent * float(np.log(max(residual[best], 1e-300) / max(behind, 1e-300)))
    if best in (0, 2 * reach):
        return Lag(None, float(constant), gain)
    low, middle, high = residual[best - 1 : best + 2]
    delay = float(best - reach + 0.5 * (low - high) / (low - 2 * middle + high))
    if abs(delay) > LEAST and residual[reach] < 1.1 * residual[best]:
        return None
    return Lag(delay * period, float(constant), gain)


def _known(evidence: AuditData, k: int, shortest: float) -> list[Run]:
    """Cut the runs of one joint into parts of more rows than `shortest` in which its model torque is known."""
    parts, stride = [], evidence.stride
    for run in evidence.runs:
        if len(run.torque) <= shortest:
            continue
        known = np.flatnonzero(np.isfinite(run.model[:, k]))
        for part in np.split(known, np.flatnonzero(np.diff(known) > 1) + 1):
            if stride * len(part) > shortest:
                start, stop = int(part[0]), int(part[-1]) + 1
                torque = run.torque[stride * start : stride * stop, k]
                parts.append(Run(torque, run.model[start:stop, k], run.velocity[start:stop, k]))
    return parts


def _unexplained(orthonormal: Array, torque: Array) -> Array:
    """Compute the sum of squares of torques, shape (N, ...), outside the span of a basis, shape (N, f)."""
    return np.asarray(np.sum(torque**2, axis=0) - np.sum((orthonormal.T @ torque) ** 2, axis=0))
