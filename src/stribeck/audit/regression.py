"""Measured torque regressed on modelled torque beside shapes of friction, with standard errors of correlated errors."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from stribeck.audit.evidence import Evidence
from stribeck.typing import Array

FRICTION_SHAPES = (0.02, 0.2)
"""Widths of the smoothed signs that stand for friction, in shares of the top speed."""
FEWEST = 20
"""Bins [1] that a regression needs."""


@dataclass(frozen=True, kw_only=True)
class Fit:
    """`torque = gain * model + friction + error` of one joint.

    Attributes
    ----------
    gain, error
        Of the torque against the model [1], and its standard error.
    share
        Of the variance that friction alone does not explain: how much the model does [1].
    swing, leverage
        Standard deviation of the model's torque that friction could not make [N m], and its share of the whole [1].
    dissipation
        Power of the friction, over its size and the speed's: from -1 (it drives) to 1 (it resists).
    friction, residual
        RMS of friction without its constant, and of the error [N m].
    friction_and_error
        Standard deviation of what the model does not explain [N m].
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


def friction_shapes(evidence: Evidence, k: int, rows: NDArray[np.bool_]) -> Array:
    """Return what friction of a joint may look like, and rotor inertia where it turns in the torque, shape (B, f).

    The constant comes first.
    """
    speeds = [(evidence.velocity[rows, k], evidence.top_speed[k])] if evidence.moves(k) else []
    for coupling in evidence.robot.couplings.values():
        if evidence.joints[k] in coupling:
            others = [evidence.joints.index(name) for name in coupling]
            speed = evidence.velocity[rows][:, others] @ np.array(list(coupling.values()))
            speeds.append((speed, float(np.percentile(np.abs(speed), 99))))
    columns = [np.ones(int(rows.sum()))]
    for speed, top in speeds:
        columns += [speed, *(np.tanh(speed / (share * max(top, 1e-9))) for share in FRICTION_SHAPES)]
    if evidence.robot.torque_source != "link_side_sensor" and evidence.moves(k):
        columns.append(evidence.acceleration[rows, k])
    return np.column_stack(columns)


def fit(evidence: Evidence, k: int, model: Array | None = None, torque: Array | None = None) -> Fit | None:
    """Return how a joint's torque depends on its model's, None where there is too little of either.

    Parameters
    ----------
    model, torque
        In place of the evidence's of this joint, shape (B,).
    """
    model = evidence.model[:, k] if model is None else model
    torque = evidence.torque[:, k] if torque is None else torque
    rows = np.isfinite(model) & np.isfinite(torque)
    if rows.sum() < FEWEST:
        return None
    shapes = friction_shapes(evidence, k, rows)
    y, m, run = torque[rows], model[rows], evidence.run[rows]
    basis = np.linalg.qr(shapes / np.maximum(np.linalg.norm(shapes, axis=0), 1e-12))[0]
    own = m - basis @ (basis.T @ m)
    left = y - basis @ (basis.T @ y)
    power = float(own @ own)
    if power <= 1e-12 * float(m @ m) or float(left @ left) == 0:
        return None
    gain = float(own @ left) / power
    error = left - gain * own
    independent = effective_share(own, error, run)
    freedom = max(1.0, len(y) * independent - shapes.shape[1] - 1)
    variance = float(error @ error) / freedom * independent
    coefficients = np.linalg.lstsq(shapes, y - gain * m, rcond=None)[0]
    friction = shapes[:, 1:4] @ coefficients[1:4] if shapes.shape[1] >= 4 else np.zeros(len(y))
    speed = evidence.velocity[rows, k]
    size = float(np.linalg.norm(friction) * np.linalg.norm(speed))
    return Fit(
        gain=gain,
        error=float(np.sqrt(variance / power / independent)),
        share=1 - float(error @ error) / float(left @ left),
        swing=float(np.sqrt(power / len(y))),
        leverage=float(np.sqrt(power / len(y)) / m.std()),
        dissipation=float(friction @ speed) / size if size else 0.0,
        friction=float(np.sqrt(np.mean(friction**2))),
        residual=float(np.sqrt(np.mean(error**2))),
        friction_and_error=float(np.std(y - gain * m)),
    )


def unexplained(evidence: Evidence, k: int, sign: float) -> float:
    """Return the share of a torque's variance that model and friction of one sign leave unexplained [1].

    Where the sign is right, the model's gain is one, friction takes power, and a rotor resists; friction seems to drive
    a joint whose torque is inverted. NaN where there is too little to say.
    """
    rows = np.isfinite(evidence.model[:, k])
    torque = sign * evidence.torque[rows, k]
    variance = float(torque.var()) if rows.sum() >= FEWEST else 0.0
    if variance == 0:
        return float("nan")
    shapes = friction_shapes(evidence, k, rows)
    columns = np.column_stack([-shapes[:, 0], shapes])
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
    _, left = nnls(columns / size, torque - evidence.model[rows, k])
    return float(left**2) / len(torque) / variance


def effective_share(regressor: Array, error: Array, run: NDArray[np.int64]) -> float:
    """Return how many independent samples there are for each that there is [1], by autocorrelation of one lag."""
    within = run[1:] == run[:-1]
    product = _lag_one(regressor, within) * _lag_one(error, within)
    return float(np.clip((1 - product) / (1 + product), 1e-3, 1.0))


def _lag_one(values: Array, within: NDArray[np.bool_]) -> float:
    first, second = values[:-1][within], values[1:][within]
    size = float(np.sqrt((first @ first) * (second @ second)))
    return float(np.clip(first @ second / size, 0.0, 0.999)) if size else 0.0
