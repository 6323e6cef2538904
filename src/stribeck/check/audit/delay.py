"""Delay, low-pass filter or another clock of the torques relative to the motion: the hypothesis that fits best."""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from stribeck.check.audit.evidence import AuditData, Run
from stribeck.check.audit.regression import friction_shapes
from stribeck.core.base.finding import Finding, Setting
from stribeck.core.base.typing import Array

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


def delays(evidence: AuditData) -> dict[str, Lag]:
    """Estimate the lag of each joint's torque; joints with a too poor fit of the model have none."""
    lags = {name: _lag(evidence, k) for k, name in enumerate(evidence.joints)}
    return {name: lag for name, lag in lags.items() if lag is not None}


def check_delay(evidence: AuditData, lags: dict[str, Lag]) -> list[Finding]:
    """Report low-pass filters, another clock, or a delay of more than a sample or two on which the joints agree.

    Three joints must have a delay, if the robot has as many, and 60 % of them must agree; 75 % of fewer than eight.
    """
    period = evidence.prepared.sampling.period
    shortest, sure = 0.01, 30.0  # time constant of a filter [s] and evidence [1] from which it replaces a delay
    slow = {name: lag for name, lag in lags.items() if lag.constant > shortest}
    if 2 * len(slow) > len(lags) and sum(lag.evidence for lag in slow.values()) > sure:
        constant = float(np.median([lag.constant for lag in slow.values()]))
        return [Finding.of("torque-filtered", tuple(slow), cutoff=1 / (2 * np.pi * constant))]
    if clock := _clock(evidence):
        return [Finding.of("torque-clock", faster=100 * abs(clock), speed="fast" if clock > 0 else "slow")]
    values = np.array([lag.delay for lag in lags.values() if lag.delay is not None])
    if len(values) < max(2, min(3, len(evidence.joints))):
        return []
    middle = float(np.median(values))
    agreeing = int(np.sum(np.abs(values - middle) < max(0.35 * abs(middle), 0.5 * period)))
    error = 1.25 * 1.48 * float(np.median(np.abs(values - middle))) / np.sqrt(len(values))  # standard error of a median
    needed = (0.6 if len(values) >= 8 else 0.75) * len(values)
    if abs(middle) < max(LEAST * period, 4.0 * error) or agreeing < max(2.0, needed):
        return []
    setting = Setting("log.torque", "delay", round(evidence.robot.log_table.torque.delay + middle, 5))
    return [Finding.of("torque-delay", delay=1e3 * middle, count=len(values), agreeing=agreeing, settings=[setting])]


def _clock(evidence: AuditData) -> float:
    """Find the relative error of the torques' clock [1]; zero if a common delay explains the torques as well.

    The mean torque over each bin of the model is taken at other times, and regressed like the measured one. Bins with
    several standing feet are left out, because the model's torque there depends on the measured one.
    """
    log, period = evidence.prepared.log, evidence.prepared.sampling.period
    compared, largest = 20.0, 0.02  # part of the log that is compared [s], and largest relative error of a clock [1]
    time = log.time[evidence.rows]
    closed = np.array(["+" in name for name in evidence.support_names], dtype=bool)[evidence.support]
    early, half = (time - log.time[0] < compared) & ~closed, 0.02
    every = max(1, round(half / (evidence.stride * period)))  # bins overlap by half
    columns, places, bases = [], [], []
    for k in range(len(evidence.joints)):
        rows = np.flatnonzero(early & np.isfinite(evidence.model[:, k]))
        if evidence.moves(k) and len(rows) > 100:
            rows = rows[::every]
            shapes = np.column_stack([friction_shapes(evidence, k, rows), evidence.model[rows, k]])
            columns.append(evidence.robot.torque_controlled[k])
            places.append(rows)
            bases.append(np.linalg.qr(shapes)[0])
    if len(bases) < 2:
        return 0.0
    sums = np.concatenate([np.zeros((1, len(columns))), np.cumsum(log.torque[:, columns], axis=0)])
    edges = np.append(log.time, log.time[-1] + period) - period / 2
    together, first = np.unique(np.concatenate(places)), log.time[0]

    def misfit(clock: float, delay: float) -> float:
        """Compute the median over the joints of the share of the torque that stays unexplained."""
        now = first + (time[together] - first) * (1 + clock) + delay
        torques = np.empty((len(time), len(columns)))
        torques[together] = _between(sums, edges, now + half) - _between(sums, edges, now - half)
        shares = [
            _unexplained(basis, torque) / max(float(np.sum((torque - torque.mean()) ** 2)), 1e-300)
            for basis, torque in zip(bases, (torques[rows, k] for k, rows in enumerate(places)), strict=True)
        ]
        return float(np.median(shares))

    reach = min(compared, float(log.time[-1] - log.time[0]))
    shifts = np.linspace(-0.03, 0.03, 7)
    plain = min(misfit(0.0, delay) for delay in shifts)
    clocks = np.arange(-largest, largest, 0.02 / reach)
    best = min(clocks, key=lambda clock: misfit(clock, 0.0))
    best = min(np.linspace(best - 0.02 / reach, best + 0.02 / reach, 9), key=lambda clock: misfit(clock, 0.0))
    return float(best) if abs(best) > 0.03 / reach and misfit(best, 0.0) < 0.5 * plain else 0.0


def _between(values: Array, times: Array, at: Array) -> Array:
    """Interpolate values, shape (T, c), at some times, shape (K,) -> (K, c)."""
    place = np.interp(at, times, np.arange(len(times)))
    before = np.minimum(place.astype(np.int64), len(times) - 2)
    share = (place - before)[:, None]
    return np.asarray((1 - share) * values[before] + share * values[before + 1])


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
