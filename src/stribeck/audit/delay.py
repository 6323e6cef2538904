"""Delay of the torques relative to the motion, if several joints agree on it."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from stribeck.audit.evidence import Evidence, Run
from stribeck.base.finding import Finding
from stribeck.base.typing import Array

MOST_SAMPLES = 6000
"""Samples of each joint that are compared [1]; shifts between them are at the log's rate."""
LEAST = 1.5
"""Smallest delay that is reported [samples]."""


def delays(evidence: Evidence) -> dict[str, float]:
    """Estimate the delay of each joint's torque [s]; joints with a too poor fit of the model have none."""
    found = {name: _delay(evidence, k) for k, name in enumerate(evidence.joints)}
    return {name: delay for name, delay in found.items() if delay is not None}


def check_delay(evidence: Evidence, found: dict[str, float]) -> list[Finding]:
    """Report a delay of more than a sample or two on which the joints agree.

    Three joints must have one, if the robot has as many, and 60 % of them must agree; 75 % of fewer than eight.
    """
    period = evidence.prepared.sampling.period
    values = np.array(list(found.values()))
    if len(values) < max(2, min(3, len(evidence.joints))):
        return []
    middle = float(np.median(values))
    agreeing = int(np.sum(np.abs(values - middle) < max(0.35 * abs(middle), 0.5 * period)))
    error = 1.25 * 1.48 * float(np.median(np.abs(values - middle))) / np.sqrt(len(values))  # standard error of a median
    needed = (0.6 if len(values) >= 8 else 0.75) * len(values)
    if abs(middle) < max(LEAST * period, 4.0 * error) or agreeing < max(2.0, needed):
        return []
    setting = evidence.robot.log_table.torque.delay + middle
    return [Finding.of("torque-delay", delay=1e3 * middle, count=len(values), agreeing=agreeing, setting=setting)]


def _delay(evidence: Evidence, k: int) -> float | None:
    """Estimate the delay of a joint's torque [s]; None if the model explains too little of the torque.

    For every shift, the torque is regressed on the model's torque, the velocity, smoothed signs of it and a constant,
    so that friction does not look like a delay. A parabola through the best shift and its neighbors gives the fraction
    of a sample. A delay that explains less than 10 % of the residual is rejected, because model errors look similar.
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
    every = -(-sum(len(run.model) for run in runs) // MOST_SAMPLES)
    rows = [np.arange(edge, len(run.model) - edge, every) for run in runs]
    both = list(zip(runs, rows, strict=True))
    speed = np.concatenate([run.velocity[own] for run, own in both])
    model = np.concatenate([run.model[own] for run, own in both])
    torque = np.concatenate([sliding_window_view(run.torque, 2 * reach + 1)[stride * own - reach] for run, own in both])
    top = max(float(np.abs(speed).max()), 1e-9)
    signs = [np.tanh(speed / (share * top)) for share in (0.01, 0.03, 0.1, 0.3)]
    without_model = np.linalg.qr(np.column_stack([np.ones(len(speed)), speed, *signs]))[0]
    with_model = np.linalg.qr(np.column_stack([without_model, model]))[0]
    left = _unexplained(with_model, torque)
    best = int(np.argmin(left))
    gained = _unexplained(without_model, torque[:, best]) - left[best]
    if best in (0, 2 * reach) or gained < 0.5 * _unexplained(without_model[:, :1], torque[:, best]):
        return None
    low, middle, high = left[best - 1 : best + 2]
    delay = float(best - reach + 0.5 * (low - high) / (low - 2 * middle + high))
    if abs(delay) > LEAST and left[reach] < 1.1 * left[best]:
        return None
    return delay * period


def _known(evidence: Evidence, k: int, shortest: float) -> list[Run]:
    """Cut the runs of one joint into parts of more rows than `shortest` in which its model torque is known."""
    found, stride = [], evidence.stride
    for run in evidence.runs:
        if len(run.torque) <= shortest:
            continue
        known = np.flatnonzero(np.isfinite(run.model[:, k]))
        for part in np.split(known, np.flatnonzero(np.diff(known) > 1) + 1):
            if stride * len(part) > shortest:
                start, stop = int(part[0]), int(part[-1]) + 1
                torque = run.torque[stride * start : stride * stop, k]
                found.append(Run(torque, run.model[start:stop, k], run.velocity[start:stop, k]))
    return found


def _unexplained(orthonormal: Array, torque: Array) -> Array:
    """Compute the sum of squares of torques, shape (N, ...), outside the span of a basis, shape (N, f)."""
    return np.asarray(np.sum(torque**2, axis=0) - np.sum((orthonormal.T @ torque) ** 2, axis=0))
