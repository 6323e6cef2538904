"""Torque error per joint: measured torque minus inverse dynamics and friction."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stribeck.base.typing import Array
from stribeck.friction import FrictionLaw, LawWithState
from stribeck.friction_torque.samples import FrictionSamples
from stribeck.judgement.curve_fit.along import along
from stribeck.judgement.joint_fit import JointFit
from stribeck.judgement.speed import top_speed

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
    found: list[dict[str, TorqueError]] = [{} for _ in errors]
    for k, name in enumerate(joint_names):
        kept = np.isfinite(torque[:, k] + sum(error[:, k] for error in errors))
        kept &= np.abs(velocity[:, k]) >= rest * top_speed(velocity[kept, k])
        variance = float(np.var(torque[kept, k])) if np.count_nonzero(kept) >= 20 else 0.0
        if variance <= 0:
            continue
        for of_model, error in zip(found, errors, strict=True):
            square = float(np.mean(error[kept, k] ** 2))
            of_model[name] = TorqueError(r2=1 - square / variance, rms=square**0.5, samples=int(kept.sum()))
    return found


def torque_r2(samples: FrictionSamples, fits: Mapping[str, JointFit], law: FrictionLaw) -> dict[str, float]:
    """Compute the coefficient of determination of each fitted joint's torque [1], samples at rest included.

    Parameters
    ----------
    samples
        Samples with the measured torque, and the friction torque without the torque of fitted rotor inertias.
    fits
        Fits by joint; friction is evaluated at the joint's mean load.
    """
    if samples.torque is None:
        return {}
    names = samples.joint_names[: samples.torque.shape[-1]]  # couplings have no measured torque
    errors = np.full((len(samples.time), len(names)), np.nan)
    for column, name in enumerate(names):
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
    (found,) = torque_errors(names, samples.velocity[:, : len(names)], samples.torque, [errors], rest=0.0)
    return {name: error.r2 for name, error in found.items()}
