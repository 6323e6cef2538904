"""Measured torque regressed on modeled torque and shapes of friction, with standard errors for correlated errors."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from stribeck.check.audit.evidence import LEAST_BINS, AuditData
from stribeck.core.base.typing import Array, BoolArray, IntArray

POOR, BETTER = 0.2, float(np.log(30.0))
"""Unexplained share of a torque from which a model fits poorly, and decrease of the logarithm of the product of these
shares from which another cause is clearly better [1]."""


@dataclass(frozen=True, kw_only=True)
class GainFit:
    """Fit of one joint: `torque = gain * model + friction + error`.

    Attributes
    ----------
    gain, error
        Gain of the torque relative to the model [1], and its standard error.
    share
        Share of the variance without friction that the model explains [1].
    swing, leverage
        Standard deviation of the model's torque that friction could not cause [N m], and its share of the whole [1].
    dissipation
        Power of the friction, divided by its size and the speed's: from -1 (it drives) to 1 (it resists).
    friction, residual
        RMS of friction without its constant, and of the error [N m].
    friction_and_error
        Standard deviation of the torque that the model does not explain [N m].
    """

    gain: float
    error: float
    share: float
    swing: float
    leverage: float
    dissipation: float
    friction: float
    residual: float
    friction_and_error: float


def friction_shapes(evidence: AuditData, k: int, rows: BoolArray | IntArray) -> Array:
    """Compute possible shapes of a joint's friction, and of rotor inertia if the torque includes it, shape (B, f).

    The constant comes first. Smoothed signs are 2 % and 20 % of the top speed wide.
    """
    speeds = [(evidence.velocity[rows, k], evidence.top_speed[k])] if evidence.moves(k) else []
    for coupling in evidence.robot.couplings.values():
        if evidence.joints[k] in coupling:
            others = [evidence.joints.index(name) for name in coupling]
            speed = evidence.velocity[rows][:, others] @ np.array(list(coupling.values()))
            speeds.append((speed, float(np.percentile(np.abs(speed), 99))))
    columns = [np.ones(len(evidence.velocity[rows, k]))]
    for speed, top in speeds:
        columns += [speed, *(np.tanh(speed / (share * max(top, 1e-9))) for share in (0.02, 0.2))]
    if evidence.robot.torque_source != "link_side_sensor" and evidence.moves(k):
        columns.append(evidence.acceleration[rows, k])
    return np.column_stack(columns)


def without(shapes: Array, *values: Array) -> list[Array]:
    """Subtract from values, shape (B, ...), their projection on shapes, shape (B, f)."""
    basis = np.linalg.qr(shapes / np.maximum(np.linalg.norm(shapes, axis=0), 1e-12))[0]
    return [value - basis @ (basis.T @ value) for value in values]


def fit(
    evidence: AuditData, k: int, model: Array | None = None, torque: Array | None = None, beside: Array | None = None
) -> GainFit | None:
    """Fit a joint's torque to its model; None if there is too little data.

    Parameters
    ----------
    model, torque
        Override the evidence's for this joint, shape (B,).
    beside
        Other torques that are fitted as well, shape (B, any).
    """
    model = evidence.model[:, k] if model is None else model
    torque = evidence.torque[:, k] if torque is None else torque
    rows = np.isfinite(model) & np.isfinite(torque)
    if rows.sum() < LEAST_BINS:
        return None
    shapes = friction_shapes(evidence, k, rows)
    if beside is not None:
        shapes = np.hstack([shapes, np.nan_to_num(beside[rows])])
    y, m = torque[rows], model[rows]
    gain, deviation, regressor, error = regress(shapes, m, y, evidence.run[rows])
    response, power = gain * regressor + error, float(regressor @ regressor)
    if power <= 1e-12 * float(m @ m) or float(response @ response) == 0:
        return None
    coefficients = np.linalg.lstsq(shapes, y - gain * m, rcond=None)[0]
    friction = shapes[:, 1:4] @ coefficients[1:4] if shapes.shape[1] >= 4 else np.zeros(len(y))
    speed = evidence.velocity[rows, k]
    size = float(np.linalg.norm(friction) * np.linalg.norm(speed))
    return GainFit(
        gain=gain,
        error=deviation,
        share=1 - float(error @ error) / float(response @ response),
        swing=float(np.sqrt(power / len(y))),
        leverage=float(np.sqrt(power / len(y)) / m.std()),
        dissipation=float(friction @ speed) / size if size else 0.0,
        friction=float(np.sqrt(np.mean(friction**2))),
        residual=float(np.sqrt(np.mean(error**2))),
        friction_and_error=float(np.std(y - gain * m)),
    )


def regress(shapes: Array, model: Array, torque: Array, run: IntArray) -> tuple[float, float, Array, Array]:
    """Regress a torque on modeled torque and shapes.

    Returns
    -------
    gain, deviation, regressor, error
        Gain and its standard error; modeled torque without the shapes, and the residual, shape (B,) each.
    """
    regressor, response = without(shapes, model, torque)
    power = max(float(regressor @ regressor), 1e-300)
    gain = float(regressor @ response) / power
    error = response - gain * regressor
    freedom = max(1.0, len(error) * effective_share(regressor, error, run) - shapes.shape[1] - 1)
    return gain, float(np.sqrt(float(error @ error) / freedom / power)), regressor, error


def unexplained(evidence: AuditData, k: int, sign: float | Array) -> float:
    """Compute the share of a torque's variance that model and friction leave unexplained if it has a sign [1].

    The sign may differ between bins, shape (B,); bins with the sign 0 are left out. The variance is that of the torque
    without the sign, because an offset of the sensor times a sign varies more than the torque.

    The model's gain is one, friction dissipates power, and a rotor resists: friction seems to drive a joint whose
    torque is inverted. NaN if there are too few bins.
    """
    rows = np.isfinite(evidence.model[:, k]) & (np.broadcast_to(sign, len(evidence.rows)) != 0)
    torque = (sign * evidence.torque[:, k])[rows]
    variance = float(evidence.torque[rows, k].var()) if rows.sum() >= LEAST_BINS else 0.0
    if variance == 0:
        return float("nan")
    shapes = friction_shapes(evidence, k, rows)
    columns = np.column_stack([-shapes[:, 0], shapes])
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
    _, norm = nnls(columns / size, torque - evidence.model[rows, k])
    return norm * norm / len(torque) / variance


def all_unexplained(evidence: AuditData, sign: float = 1.0) -> Array:
    """Compute the share that `unexplained` finds for each joint, shape (k,)."""
    return np.array([unexplained(evidence, k, sign) for k in range(len(evidence.joints))])


def misfit(shares: Array) -> float:
    """Compute the logarithm of the product of unexplained shares, shape (k,); unknown ones count as one."""
    return float(np.log(np.clip(np.nan_to_num(shares, nan=1.0), 1e-3, 1.0)).sum())


def winner(costs: Mapping[str, float], margin: float) -> str:
    """Choose the cause that costs less than all others by a margin; "" (no cause) wins unless it is clearly beaten."""
    best, *others = sorted(costs, key=costs.__getitem__)
    return best if costs[best] <= min((costs[other] for other in others), default=np.inf) - margin else ""


def effective_share(regressor: Array, error: Array, run: IntArray) -> float:
    """Estimate the number of independent samples per sample [1] from the autocorrelation at a lag of one."""
    within = run[1:] == run[:-1]
    product = _lag_one(regressor, within) * _lag_one(error, within)
    return float(np.clip((1 - product) / (1 + product), 1e-3, 1.0))


def _lag_one(values: Array, within: BoolArray) -> float:
    first, second = values[:-1][within], values[1:][within]
    size = float(np.sqrt((first @ first) * (second @ second)))
    return float(np.clip(first @ second / size, 0.0, 0.999)) if size else 0.0
