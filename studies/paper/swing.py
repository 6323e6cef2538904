"""Samples of the joints of a swinging leg, the right leg as in the paper, and measures of a friction curve."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stribeck.base.typing import Array
from stribeck.judgement.passivity import positive_power_fraction
from studies.paper.estimate import Estimate

JOINTS = ("hip_roll", "hip_pitch", "hip_yaw", "knee", "ankle_roll", "ankle_pitch")
SIDE = "right"
SUPPORT = "left_foot"
"""Support while the right leg swings."""
OTHER_SIDE, OTHER_SUPPORT = "left", "right_foot"
BINS = 30
"""Number of velocity bins in which rising and falling branch are compared."""
FEWEST = 5
"""Minimum number of samples of a branch in a bin."""


class Swing(NamedTuple):
    """Samples of one joint, shape (N,) each."""

    time: Array  # [s]
    velocity: Array  # [rad/s]
    acceleration: Array  # [rad/s^2]
    torque: Array  # estimated friction torque [N m]
    truth: Array  # true friction torque [N m]

    def thinned(self, stride: int) -> Swing:
        """Select every `stride`-th sample."""
        return Swing(*(each[::stride] for each in self))


def swinging(found: Estimate, joint: str, side: str = SIDE) -> Swing:
    """Select the samples of a joint while its leg swings."""
    rows = found.standing_on(SUPPORT if side == SIDE else OTHER_SUPPORT)
    column, samples = found.column(f"{side}_{joint}"), found.samples
    return Swing(
        samples.time[rows],
        samples.velocity[rows, column],
        samples.acceleration[rows, column],
        samples.friction_torque[rows, column],
        found.truth[rows, column],
    )


def split(velocity: Array, acceleration: Array, torque: Array) -> float:
    """Compute the distance between the branches of rising and falling velocity [N m].

    It is the RMS difference of the branches' mean torques over velocity bins that both branches pass.
    """
    edges = np.linspace(velocity.min(), velocity.max(), BINS + 1)
    place = np.clip(np.digitize(velocity, edges) - 1, 0, BINS - 1)
    counts, means = np.zeros((2, 2, BINS))
    for k, branch in enumerate((acceleration > 0, acceleration <= 0)):
        counts[k] = np.bincount(place[branch], minlength=BINS)
        sums = np.bincount(place[branch], torque[branch], minlength=BINS)
        means[k] = sums / np.maximum(counts[k], 1)
    weight = np.where(counts.min(axis=0) >= FEWEST, counts.min(axis=0), 0)
    if not weight.any():
        return float("nan")
    return float(np.sqrt(np.average((means[0] - means[1]) ** 2, weights=weight)))


def feeding(velocity: Array, torque: Array) -> float:
    """Compute the share of samples in which a friction torque has positive power, contrary to (7.9)."""
    return positive_power_fraction(velocity, torque)
