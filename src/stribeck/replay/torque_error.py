"""How much of the measured torque a model explains by inverse dynamics, joint by joint."""

from dataclasses import dataclass

import numpy as np

from stribeck.friction_torque.stage import thinned_samples
from stribeck.identification.judgement.speed import top_speed
from stribeck.identification.judgement.torque_r2 import LEAST_SAMPLES
from stribeck.preparation import PreparedLog
from stribeck.replay.model_friction import ModelFriction
from stribeck.robot import Robot
from stribeck.settings import Settings


@dataclass(frozen=True, kw_only=True)
class TorqueError:
    """The torque error of a joint.

    Attributes
    ----------
    r2
        1 - sum e^2 / sum (tau - mean tau)^2 with e = tau - inverse dynamics - R(v).
    rms
        Of e [N m], [N].
    samples
        That it is over.
    """

    r2: float
    rms: float
    samples: int


def torque_errors(
    prepared: PreparedLog, robot: Robot, frictions: list[ModelFriction], settings: Settings
) -> list[dict[str, TorqueError]]:
    """Return the torque error of a model with each of some frictions, by joint.

    Over samples that a fit may use in which the joint moves faster than `settings.rest` times its top speed: at rest
    Coulomb friction holds against any torque. Torque and motion have passed the same filter.
    """
    samples = thinned_samples(prepared, 1, robot, settings)
    assert samples.torque is not None  # the friction torque is worked out from it
    columns = [robot.joint_names.index(name) for name in samples.joint_names]
    found: list[dict[str, TorqueError]] = [{} for _ in frictions]
    velocity = np.zeros((len(samples.time), len(robot.joint_names)))
    velocity[:, columns] = samples.velocity
    errors = [samples.friction_torque - friction.torque(velocity)[:, columns] for friction in frictions]
    for k, joint in enumerate(samples.joint_names):
        kept = samples.usable[:, k] & np.isfinite(samples.friction_torque[:, k] + samples.torque[:, k])
        kept &= np.abs(samples.velocity[:, k]) >= settings.rest * top_speed(samples.velocity[kept, k])
        variance = float(np.var(samples.torque[kept, k])) if np.count_nonzero(kept) >= LEAST_SAMPLES else 0.0
        if variance <= 0:
            continue
        for of_joint, error in zip(found, errors, strict=True):
            square = float(np.mean(error[kept, k] ** 2))
            of_joint[joint] = TorqueError(r2=1 - square / variance, rms=square**0.5, samples=int(kept.sum()))
    return found
