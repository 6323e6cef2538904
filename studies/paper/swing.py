"""Samples of the joints of a swinging leg, the right leg as in the paper."""

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
