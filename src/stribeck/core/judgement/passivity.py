"""Passivity: friction dissipates power, v (R - offset) >= 0 (Equation 7.9 of the term paper)."""

from collections.abc import Mapping

import numpy as np

from stribeck.core.base.finding import Finding
from stribeck.core.base.typing import Array
from stribeck.core.result import JointResult
from stribeck.core.result.samples import FrictionSamples


def passivity_violated(joints: Mapping[str, JointResult], samples: FrictionSamples) -> list[Finding]:
    """Report joints whose measured friction torque adds power beyond its own noise."""
    powers = {}
    for column, name in enumerate(samples.joint_names):
        joint = joints.get(name)
        if joint is None or joint.verdict == "not excited":
            continue
        offset = joint.parameters["offset"].value if "offset" in joint.parameters else 0.0
        if power := added_power(samples, column, offset):
            powers[name] = f"{name} ({power:.2g} W)"
    return [Finding.of("passivity", tuple(powers), evidence=", ".join(powers.values()))] if powers else []


def added_power(samples: FrictionSamples, column: int, offset: float) -> float:
    """Compute the mean power that the measured friction torque adds to a joint [W]; 0 if it is within noise.

    Noise makes the power of single samples negative half of the time, but not the mean. The noise of the mean is
    estimated from the differences between blocks, at least five. In `studies.misfits`, every log with torques of the
    wrong sign has a joint with at least 4.5 standard errors; all joints of other logs have at most 2.4.
    """
    rows = samples.usable[:, column] & np.isfinite(samples.friction_torque[:, column])
    power = samples.velocity[rows, column] * (samples.friction_torque[rows, column] - offset)
    _, block = np.unique(samples.block[rows], return_inverse=True)
    count = np.bincount(block)
    if len(count) < 5:
        return 0.0
    mean = float(power.mean())
    spread = np.bincount(block, power) - mean * count
    error = float(np.sqrt((spread**2).sum() * len(count) / (len(count) - 1)) / len(power))
    return -mean if mean < -4.0 * error else 0.0


def positive_power_fraction(velocity: Array, friction_torque: Array) -> float:
    """Compute the share of samples in which friction without its offset adds power [1], v R < 0.

    The paper's tau_f is -R, so its P = v tau_f is positive in these samples.
    """
    power = velocity * friction_torque
    usual = float(np.sqrt(np.mean(velocity**2) * np.mean(friction_torque**2)))
    return float(np.mean(power < -1e-3 * usual))  # smaller powers are rounding or standstill
