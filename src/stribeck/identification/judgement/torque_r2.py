"""How much of the measured torque a model explains with the friction that was found."""

from collections.abc import Mapping

import numpy as np

from stribeck.friction import FrictionLaw, LawWithState
from stribeck.identification.curve_fit.along import along
from stribeck.identification.joint_fit import JointFit
from stribeck.result import law_values
from stribeck.samples import Samples

LEAST_SAMPLES = 20
"""Of a joint: fewer say nothing of a variance."""


def torque_r2(samples: Samples, fits: Mapping[str, JointFit], law: FrictionLaw) -> dict[str, float]:
    """Return the coefficient of determination of each joint's torque, of those that it is known of.

    1 - sum e^2 / sum (tau - mean tau)^2 over a joint's usable samples, with e = tau - inverse dynamics - R(v), which is
    the friction torque less the law, at the joint's mean load. It is about the torque as the filter leaves it.

    Parameters
    ----------
    samples
        With the measured torque, and the friction torque without the torque of fitted rotor inertias.
    fits
        By joint.
    """
    if samples.torque is None:
        return {}
    found = {}
    for column, joint in enumerate(samples.joint_names[: samples.torque.shape[1]]):
        if joint not in fits:
            continue
        fit = fits[joint]
        values = law_values(law, dict(zip(fit.names, fit.values.tolist(), strict=True)), fit.mean_load)
        torque, friction = samples.torque[:, column], samples.friction_torque[:, column]
        kept = samples.usable[:, column] & np.isfinite(friction) & np.isfinite(torque)
        variance = float(np.var(torque[kept])) if np.count_nonzero(kept) >= LEAST_SAMPLES else 0.0
        if values is None or variance <= 0:
            continue
        if isinstance(law, LawWithState):
            part = along(samples, column, np.flatnonzero(kept))
            predicted = part.average(law.torque_along(part.motion, values))
        else:
            predicted = law.torque(samples.velocity[kept, column], values)
        error = friction[kept] - predicted
        found[joint] = 1 - float(np.mean(error**2)) / variance
    return {joint: value for joint, value in found.items() if np.isfinite(value)}
