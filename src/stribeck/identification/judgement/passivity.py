"""Whether friction takes power out of the joints, as it must (7.9)."""

from collections.abc import Mapping

import numpy as np

from stribeck.finding import Finding
from stribeck.result import JointResult
from stribeck.samples import Samples

LEAST_NEGATIVE = 4.0
"""Power that friction adds on average, in its standard errors over the blocks [1], from which passivity is violated.

In `studies.what_is_told` it is at least 4.5 in a joint of every log with torques of the wrong sign, and at most 2.4 in
any joint of all other logs.
"""

FEWEST_BLOCKS = 5
"""Blocks [1] from which their differences are a standard error."""


def passivity_violated(joints: Mapping[str, JointResult], samples: Samples) -> list[Finding]:
    """Return a finding on joints whose friction torque adds power beyond its own noise.

    The power is v (R - offset), of the friction torque that was measured and not of a law, which adds none. In noise
    and at rest it is negative half of the time; its mean is not.
    """
    found = {}
    for column, name in enumerate(samples.joint_names):
        joint = joints.get(name)
        if joint is None or joint.verdict == "not excited":
            continue
        offset = joint.parameters["offset"].value if "offset" in joint.parameters else 0.0
        power, errors = mean_power(samples, column, offset)
        if power < -LEAST_NEGATIVE * errors:
            found[name] = f"{name} ({-power:.2g} W)"
    if not found:
        return []
    return [
        Finding(
            check="passivity",
            text=f"passivity violated, friction adds power on average: {', '.join(found.values())}",
            cure="check signs and delays of these torques ('stribeck inspect'), and the inertias of the model",
            joints=tuple(found),
        )
    ]


def mean_power(samples: Samples, column: int, offset: float) -> tuple[float, float]:
    """Return the mean power that a joint's friction takes [W], and its standard error; infinite of too few blocks."""
    rows = samples.usable[:, column] & np.isfinite(samples.friction_torque[:, column])
    power = samples.velocity[rows, column] * (samples.friction_torque[rows, column] - offset)
    _, block = np.unique(samples.block[rows], return_inverse=True)
    count = np.bincount(block)
    if len(count) < FEWEST_BLOCKS:
        return 0.0, float("inf")
    mean = float(power.mean())
    spread = np.bincount(block, power) - mean * count
    return mean, float(np.sqrt((spread**2).sum() * len(count) / (len(count) - 1)) / len(power))
