"""Torque error per joint: measured torque minus inverse dynamics and friction."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.friction import FrictionLaw, LawWithState
from stribeck.core.judgement.curve_fit.along import along
from stribeck.core.judgement.joint_fit import JointFit
from stribeck.core.judgement.speed import top_speed
from stribeck.core.result.samples import FrictionSamples

COMMON = {"filter_torque": True, "averaged_law": False, "standing_legs": False, "observer_bandwidth": None}
"""Settings for comparing torque errors of methods and models: one filter, and only swinging limbs."""


@dataclass(frozen=True, kw_only=True)
class TorqueError:
    """The torque error of a joint.

    Attributes
    ----------
    r2
        1 - sum e^2 / sum (tau - mean tau)^2 with the error e and the measured torque tau.
    rms
        Root mean square of e [N m], [N].
    samples
        Number of samples compared.
    """

    r2: float
    rms: float
    samples: int


def torque_errors(
    joint_names: Sequence[str], velocity: Array, torque: Array, errors: Sequence[Array], rest: float
) -> list[dict[str, TorqueError]]:
    """Summarize torque errors per joint, over samples in which all of them are finite and the joint moves.

    Samples slower than `rest` times the joint's top speed are excluded, because Coulomb friction balances any torque.

    Parameters
    ----------
    joint_names
        The n joints.
    velocity, torque
        Velocity [rad/s] and measured torque [N m], shape (N, n).
    errors
        One array per compared model [N m], shape (N, n); NaN where unknown.
    rest
        Share of the top speed [1].

    Returns
    -------
    torque_errors
        One mapping per model; joints with fewer than 20 samples or a constant torque are omitted.
    """
    summaries: list[dict[str, TorqueError]] = [{} for _ in errors]
    for k, name in enumerate(joint_names):
        kept = np.isfinite(torque[:, k] + sum(error[:, k] for error in errors))
        kept &= np.abs(velocity[:, k]) >= rest * top_speed(velocity[kept, k])
        variance = float(np.var(torque[kept, k])) if np.count_nonzero(kept) >= 20 else 0.0
        if variance <= 0:
            continue
        for of_model, error in zip(summaries, errors, strict=True):
            square = float(np.mean(error[kept, k] ** 2))
            of_model[name] = TorqueError(r2=1 - square / variance, rms=square**0.5, samples=int(kept.sum()))
    return summaries


def friction_errors(samples: FrictionSamples, fits: Mapping[str, JointFit], law: FrictionLaw) -> Array:
    """Compute the friction torque minus the friction of the fits [N m], [N], shape (T, n); NaN where unknown.

    Parameters
    ----------
    samples
        Samples of the friction torque without the torque of fitted rotor inertias.
    fits
        Fits by joint; friction is evaluated at the joint's mean load.
    """
    errors = np.full(samples.friction_torque.shape, np.nan)
    for column, name in enumerate(samples.joint_names):
        rows = np.flatnonzero(samples.usable[:, column])
        if name not in fits or not len(rows):
            continue
        values = fits[name].law_values(law, fits[name].mean_load)
        if isinstance(law, LawWithState):
            part = along(samples, column, rows)
            friction = part.average(law.torque_along(part.motion, values))
        else:
            friction = law.torque(samples.velocity[rows, column], values)
        errors[rows, column] = samples.friction_torque[rows, column] - friction
    return errors


def change_by_inertias(torque: Array, given: Array, corrected: Array) -> tuple[float, float] | None:
    """Compute the change of torque errors by corrected inertias, and its standard error.

    It is the mean logarithm of the ratio of RMS errors over joints and ten blocks of the log. The standard error
    follows from the blocks, because joints gain differently. Errors below a thousandth of the torque do not count.

    Parameters
    ----------
    torque, given, corrected
        Measured torque, and torque errors with both inertias [N m], [N], shape (T, n); NaN where unknown.

    Returns
    -------
    change
        Mean and standard error [1]; None without samples in two blocks.
    """
    known = np.isfinite(given) & np.isfinite(corrected)
    squares = known * (np.nan_to_num([given, corrected]) ** 2 + 1e-6 * np.var(np.nan_to_num(torque), axis=0))
    edges = np.linspace(0, len(given), 11).astype(int)[:-1]
    count = np.add.reduceat(known, edges, dtype=int)
    enough = count >= 8
    before, after = np.add.reduceat(squares, edges, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        changes = np.where(enough, np.log(after / before) / 2, 0.0)
        blocks = (changes.sum(axis=1) / enough.sum(axis=1))[enough.any(axis=1)]
    if len(blocks) < 2:
        return None
    return float(blocks.mean()), float(blocks.std(ddof=1) / len(blocks) ** 0.5)
