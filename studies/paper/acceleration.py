"""The model's acceleration (5.10), what the measured torque would do without friction, beside the measured one."""

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
"""Keeps the paper's window of 151 samples off the impacts."""
UNFILTERED = Settings(filter=Differences(scheme="central"), support=TRIMMED, filter_torque=False)
AS_PAPER = Settings(filter=FilterSettings(kind="savitzky-golay", window=151), support=TRIMMED, filter_torque=False)
"""The acceleration is filtered and the torque is not."""


def model_acceleration(walk: Simulated, found: Estimate) -> Array:
    """Return the model's acceleration of the swinging right leg's joints [rad/s^2], shape (N, 6).

    `a_est = a_msr + M_mod^-1 R` over all torque-controlled joints, (5.13) solved for it. The measured acceleration
    cancels: R has it, times M_mod, with the other sign.
    """
    samples, rows = found.samples, found.standing_on(SUPPORT)
    here = np.searchsorted(walk.log.time, samples.time[rows] - samples.period / 2)
    known = walk.robot.torque_controlled
    inertia = joint_inertia(walk.robot.rooted_at(SUPPORT), walk.log.position[here])[:, known[:, None], known]
    change = np.linalg.solve(inertia, samples.friction_torque[rows][:, :, None])[:, :, 0]
    columns = [found.column(f"{SIDE}_{joint}") for joint in JOINTS]
    return np.asarray((samples.acceleration[rows] + change)[:, columns])


def calibrated(walk: Simulated) -> Simulated:
    """Return the walk with the friction's offset, which dissipates nothing, taken out of its torque and its truth."""
    offset = np.array([walk.truth.parameters.get(name, {}).get("offset", 0.0) for name in walk.log.joint_names])
    log = replace(walk.log, torque=walk.log.torque - offset)
    return replace(walk, log=log, truth=replace(walk.truth, friction_torque=walk.truth.friction_torque - offset))


class Motion(NamedTuple):
    """A joint of the right leg, over some of its swings or all, shape (N,) each."""

    time: Array  # [s]
    velocity: Array  # [rad/s]
    measured: Array  # acceleration [rad/s^2]
    model: Array  # acceleration [rad/s^2]

    def last_swing(self) -> Motion:
        """Return the last swing alone, its time from 0."""
        breaks = np.flatnonzero(np.diff(self.time) > 1.5 * np.min(np.diff(self.time))) + 1
        first = breaks[-1] if len(breaks) else 0
        time, *others = (each[first:] for each in self)
        return Motion(time - time[0], *others)


def motions(walk: Simulated, settings: Settings) -> dict[str, Motion]:
    """Return the motion of each joint of the right leg over all its swings."""
    found = estimate(walk, settings)
    model = model_acceleration(walk, found)
    joints = {joint: swinging(found, joint) for joint in JOINTS}
    return {
        joint: Motion(each.time, each.velocity, each.acceleration, model[:, k])
        for k, (joint, each) in enumerate(joints.items())
    }
