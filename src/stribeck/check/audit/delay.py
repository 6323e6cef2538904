"""Delay, low-pass filter or another clock of the torques relative to the motion: the hypothesis that fits best."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from stribeck.check.audit.evidence import BIN, LEAST_BINS, AuditData
from stribeck.check.audit.regression import friction_shapes
from stribeck.core.base.finding import Finding, Setting
from stribeck.core.base.typing import Array, BoolArray

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
    """Mean torque of a joint over its bins at other times, regressed on friction and on the model's torque in the bins.

    Bins with several standing feet are left out, because the model's torque there depends on the measured one.

    Attributes
    ----------
    sums, edges
        Integral of the torque up to the edges of the samples, and the edges [s].
    times, shapes
        Centers of the bins [s], and friction shapes and the model's torque there.
    """

    sums: Array
    edges: Array
    times: Array
    shapes: Array

    def torque(self, clock: float = 0.0, delay: float = 0.0) -> Array:
        """Compute the mean torque over the bins, with a relative error of its clock [1] and a delay [s]."""
        now = self.edges[0] + (self.times - self.edges[0]) * (1 + clock) + delay
        ends = (np.interp(now + side * BIN / 2, self.edges, self.sums) for side in (1, -1))
        return np.asarray(next(ends) - next(ends)) / BIN


def _timings(evidence: AuditData, used: BoolArray, slowest: float) -> dict[str, _Timing]:
    """Collect the used bins of each moving joint, shape (B,), from a speed relative to its top speed [1]."""
    log, period = evidence.prepared.log, evidence.prepared.sampling.period
    size = max(1, round(BIN / period))
    time = log.time[evidence.rows] + ((size - evidence.stride) / 2 - size // 2) * period  # means of thinned rows
    closed = np.array(["+" in name for name in evidence.support_names], dtype=bool)[evidence.support]
    edges, found = np.append(log.time, log.time[-1] + period) - period / 2, {}
    for k, column in enumerate(evidence.robot.torque_controlled):
        sliding = np.abs(evidence.velocity[:, k]) >= slowest * evidence.top_speed[k]
        rows = np.flatnonzero(used & ~closed & sliding & np.isfinite(evidence.model[:, k]))
        if evidence.moves(k) and len(rows) > LEAST_BINS:
            shapes = np.column_stack([friction_shapes(evidence, k, rows), evidence.model[rows, k]])
            sums = np.append(0.0, np.cumsum(log.torque[:, column]) * period)
            found[evidence.joints[k]] = _Timing(sums, edges, time[rows], shapes)
    return found


def delays(evidence: AuditData) -> dict[str, Lag]:
    """Estimate the lag of each joint's torque; joints with a too poor fit of the model have none."""
    period = evidence.prepared.sampling.period
    reach = max(5, round(SHORT / period))
    margin = -(-reach // max(1, round(BIN / period)))  # bins that are closer to the ends of runs see other runs
    runs = np.pad(evidence.run, margin, constant_values=-1)
    inner = runs[2 * margin :] == runs[: len(runs) - 2 * margin]
    timings = _timings(evidence, inner, slowest=0.2)  # slower bins may contain a reversal
    lags = {name: _lag(timing, period, reach) for name, timing in timings.items()}
    return {name: lag for name, lag in lags.items() if lag is not None}


def _lag(timing: _Timing, period: float, reach: int) -> Lag | None:
    """Estimate the lag of a joint's torque within some samples; None if the model explains too little of the torque.

    A parabola through the best shift and its neighbors gives the fraction of a sample. A delay that explains less than
    10 % of the residual is rejected, because model errors look similar. A low-pass filter of first order with the time
    constant T is undone: the torque before it is y + T dy/dt.
    """
    friction, both = (np.linalg.qr(shapes)[0] for shapes in (timing.shapes[:, :-1], timing.shapes))
    torque = np.column_stack([timing.torque(delay=shift * period) for shift in range(-reach, reach + 1)])
    residual = _unexplained(both, torque)
    best = int(np.argmin(residual))
    if not _unexplained(friction, torque[:, best]) - residual[best] > 0.5 * len(torque) * torque[:, best].var():
        return None
    apart = max(1, round(0.005 / period))
    rate = (torque[:, reach + apart] - torque[:, reach - apart]) / (2 * apart * period)
    constant = -float(np.linalg.lstsq(np.column_stack([both, rate]), torque[:, reach], rcond=None)[0][-1])
    behind = _unexplained(both, torque[:, reach] + constant * rate)
    independent = len(torque) * BIN / 0.05  # the model is filtered
    gain = 0.5 * independent * float(np.log(max(residual[best], 1e-300) / max(behind, 1e-300)))
    if best in (0, 2 * reach):
        return Lag(None, constant, gain)
    low, middle, high = residual[best - 1 : best + 2]
    delay = float(best - reach + 0.5 * (low - high) / (low - 2 * middle + high))
    if abs(delay) > LEAST and residual[reach] < 1.1 * residual[best]:
        return None
    return Lag(delay * period, constant, gain)


def check_delay(evidence: AuditData, lags: dict[str, Lag]) -> list[Finding]:
    """Report low-pass filters, running means, another clock, or a delay of more than a sample or two.

    A short delay is reported if half of the joints have one, at least three (or all of a smaller robot), and 60 % of
    them agree, or 75 % of fewer than eight.
    """
    period, few = evidence.prepared.sampling.period, min(3, len(evidence.joints))
    shortest, sure = 0.01, 30.0  # time constant of a filter [s] and evidence [1] from which it replaces a delay
    slow = {name: lag for name, lag in lags.items() if lag.constant > shortest}
    if len(slow) >= max(few, len(lags) / 2) and sum(lag.evidence for lag in slow.values()) > sure:
        constant = float(np.median([lag.constant for lag in slow.values()]))
        return [Finding.of("torque-filtered", evidence.joints, cutoff=1 / (2 * np.pi * constant))]
    if other := _other_times(evidence):
        return other
    values = np.array([lag.delay for lag in lags.values() if lag.delay is not None])
    if len(values) < max(2, few, len(evidence.joints) / 2):
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
    time, fewest = evidence.prepared.log.time, 100  # bins [1]
    early = time[evidence.rows] - time[0] < compared
    timings = [one for one in _timings(evidence, early, slowest=0.0).values() if len(one.times) > fewest]
    if len(timings) < 2:
        return []
    bases = [np.linalg.qr(timing.shapes)[0] for timing in timings]

    def left(clock: float = 0.0, delay: float = 0.0) -> Array:
        """Compute the share of each torque's variance that a clock or a delay leaves unexplained, shape (k,)."""
        torques = [timing.torque(clock, delay) for timing in timings]
        return np.maximum(list(map(_share, bases, torques)), 1e-12)

    def best(candidates: Array, apart: float, left: Callable[[float], Array]) -> tuple[float, Array]:
        """Choose the candidate that fits best, refined between its neighbors at a distance."""
        for near in (apart, apart / 5, 0.0):
            shares = [left(value) for value in candidates]
            number = int(np.argmin(np.mean(np.log(shares), axis=1)))
            chosen, share = float(candidates[number]), shares[number]
            candidates = chosen + near * np.linspace(-1, 1, 9)
        return chosen, share

    duration = time[-1] - time[0]
    reach, longest = min(compared, duration), min(LONGEST, duration / 8)
    plain = min((left(0.0, delay) for delay in np.linspace(-SHORT, SHORT, 7)), key=np.median)
    clock, of_clock = best(np.arange(-largest, largest, 0.02 / reach), 0.02 / reach, left)
    delay, of_delay = best(np.arange(-longest, longest, 0.02), 0.02, lambda delay: left(0.0, delay))
    if np.median(np.minimum(of_clock, of_delay)) > 0.5 * np.median(plain):
        return []
    if np.median(of_clock) < np.median(of_delay):
        faster, speed = 100 * abs(clock), "fast" if clock > 0 else "slow"
        return [Finding.of("torque-clock", faster=faster, speed=speed)] if abs(clock) > 0.03 / reach else []
    agreeing = int(np.sum(of_delay < 0.5 * plain))
    if not SHORT < abs(delay) < 0.95 * longest or agreeing < max(2.0, 0.6 * len(plain)):
        return []
    mean = round(2 * abs(delay) / BIN)
    bases = [np.linalg.qr(uniform_filter1d(timing.shapes, mean, axis=0))[0] for timing in timings]
    if delay > 0 and np.median(left(0.0, delay)) < 0.5 * np.median(of_delay):
        return [Finding.of("torque-filtered.mean", length=2e3 * delay)]
    return [_late(evidence, "torque-delay.long", delay, len(plain), agreeing)]


def _late(evidence: AuditData, check: str, delay: float, count: int, agreeing: int) -> Finding:
    """Report a delay of the torques [s] with the setting that corrects it."""
    setting = Setting("log.torque", "delay", round(evidence.robot.log_table.torque.delay + delay, 5))
    return Finding.of(check, delay=1e3 * delay, count=count, agreeing=agreeing, settings=[setting])


def _share(basis: Array, torque: Array) -> float:
    """Compute the share of a torque's variance outside the span of a basis."""
    return float(_unexplained(basis, torque)) / max(len(torque) * float(torque.var()), 1e-300)


def _unexplained(orthonormal: Array, torque: Array) -> Array:
    """Compute the sum of squares of torques, shape (N, ...), outside the span of a basis, shape (N, f)."""
    return np.asarray(np.sum(torque**2, axis=0) - np.sum((orthonormal.T @ torque) ** 2, axis=0))
