"""Samples of the joints of a swinging leg, the right leg as in the paper, and measures of a friction curve."""

from typing import NamedTuple

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.dynamics.rooted import joint_inertia
from stribeck.simulation.run import Simulated
from studies.paper.estimate import Estimate

JOINTS = ("hip_roll", "hip_pitch", "hip_yaw", "knee", "ankle_roll", "ankle_pitch")
"""Names of the joints in tables."""
SIDE = "right"
SUPPORT = "left_foot"
"""Support while the right leg swings."""
BINS = 30
"""Number of velocity bins in which rising and falling branch are compared."""
FEWEST = 5
"""Minimum number of samples of a branch in a bin."""


class Swing(NamedTuple):
    """Samples of one joint of the right leg, shape (N,) each."""

    time: Array  # [s]
    velocity: Array  # [rad/s]
    acceleration: Array  # [rad/s^2]
    torque: Array  # estimated friction torque [N m]
    truth: Array  # true friction torque [N m]


def swinging(found: Estimate, joint: str) -> Swing:
    """Select the samples of a joint while its leg swings."""
    rows, column, samples = found.standing_on(SUPPORT), found.column(f"{SIDE}_{joint}"), found.samples
    return Swing(
        samples.time[rows],
        samples.velocity[rows, column],
        samples.acceleration[rows, column],
        samples.friction_torque[rows, column],
        found.truth[rows, column],
    )


def model_acceleration(walk: Simulated, found: Estimate) -> Array:
    """Compute the acceleration (5.10) that the measured torque causes without friction [rad/s^2], shape (N, 6).

    (5.13) gives `a_est = a_msr + M_mod^-1 R` over all torque-controlled joints. The measured acceleration cancels,
    because R contains -M_mod a_msr. The columns are the swinging right leg's joints.
    """
    samples, rows = found.samples, found.standing_on(SUPPORT)
    here = np.searchsorted(walk.log.time, samples.time[rows] - samples.period / 2)
    known = walk.robot.torque_controlled
    inertia = joint_inertia(walk.robot.rooted_at(SUPPORT), walk.log.position[here])[:, known[:, None], known]
    change = np.linalg.solve(inertia, samples.friction_torque[rows][:, :, None])[:, :, 0]
    columns = [found.column(f"{SIDE}_{joint}") for joint in JOINTS]
    return np.asarray((samples.acceleration[rows] + change)[:, columns])


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
