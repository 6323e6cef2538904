"""Model acceleration (5.10), which the measured torque causes without friction, versus measured acceleration."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from stribeck import Settings
from stribeck.base.typing import Array
from stribeck.dynamics.rooted import joint_inertia
from stribeck.settings import FilterSettings, SupportSettings
from stribeck_simulation.run import Simulated
from studies.paper.estimate import Differences, Estimate, estimate
from studies.paper.swing import JOINTS, SIDE, SUPPORT, swinging

TRIMMED = SupportSettings(trim_start=0.1, trim_end=0.1)
"""Trimming that excludes impacts from the paper's window of 151 samples."""
UNFILTERED = Settings(filter=Differences(scheme="central"), support=TRIMMED, filter_torque=False)
AS_PAPER = Settings(filter=FilterSettings(kind="savitzky-golay", window=151), support=TRIMMED, filter_torque=False)
"""Settings of the paper: a filtered acceleration and an unfiltered torque."""


def model_acceleration(walk: Simulated, found: Estimate) -> Array:
    """Compute the model's acceleration of the swinging right leg's joints [rad/s^2], shape (N, 6).

    (5.13) gives `a_est = a_msr + M_mod^-1 R` over all torque-controlled joints. The measured acceleration cancels,
    because R contains -M_mod a_msr.
    """
    samples, rows = found.samples, found.standing_on(SUPPORT)
    here = np.searchsorted(walk.log.time, samples.time[rows] - samples.period / 2)
    known = walk.robot.torque_controlled
    inertia = joint_inertia(walk.robot.rooted_at(SUPPORT), walk.log.position[here])[:, known[:, None], known]
    change = np.linalg.solve(inertia, samples.friction_torque[rows][:, :, None])[:, :, 0]
    columns = [found.column(f"{SIDE}_{joint}") for joint in JOINTS]
    return np.asarray((samples.acceleration[rows] + change)[:, columns])


def calibrated(walk: Simulated) -> Simulated:
    """Subtract the friction's offset, which dissipates nothing, from a walk's torque and ground truth."""
    offset = np.array([walk.truth.parameters.get(name, {}).get("offset", 0.0) for name in walk.log.joint_names])
    log = replace(walk.log, torque=walk.log.torque - offset)
    return replace(walk, log=log, truth=replace(walk.truth, friction_torque=walk.truth.friction_torque - offset))


class Motion(NamedTuple):
    """Motion of one joint of the right leg during swings, shape (N,) each."""

    time: Array  # [s]
    velocity: Array  # [rad/s]
    measured: Array  # acceleration [rad/s^2]
    model: Array  # acceleration [rad/s^2]


def motions(walk: Simulated, settings: Settings) -> dict[str, Motion]:
    """Compute the motion of each joint of the right leg over all its swings."""
    found = estimate(walk, settings)
    model = model_acceleration(walk, found)
    joints = {joint: swinging(found, joint) for joint in JOINTS}
    return {
        joint: Motion(each.time, each.velocity, each.acceleration, model[:, k])
        for k, (joint, each) in enumerate(joints.items())
    }
