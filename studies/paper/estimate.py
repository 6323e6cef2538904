"""The friction torque of a simulated walk, sample by sample, beside its truth."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stribeck import Settings
from stribeck.friction_torque.stage import torque_chunks, with_filter
from stribeck.friction_torque.thinning import join
from stribeck.preparation import prepare
from stribeck.samples import Samples
from stribeck.settings import FilterSettings, SupportSettings
from stribeck.typing import Array
from stribeck_simulation.run import Simulated

UNTRIMMED = SupportSettings(trim_start=0.0, trim_end=0.0)
"""Of the ideal simulator, whose feet touch down without a blow."""
EXACT = FilterSettings(kind="log")
"""Velocity and acceleration as an ideal log has them, nothing differentiated."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """Estimated friction torque, and the truth at the same samples and joints, shape (N, n) [N m]."""

    samples: Samples
    truth: Array

    @property
    def error(self) -> Array:
        """Estimate less truth [N m], shape (N, n); NaN where there is no estimate."""
        return np.asarray(self.samples.friction_torque - self.truth)

    def column(self, joint: str) -> int:
        """Return the column of a joint."""
        return self.samples.joint_names.index(joint)

    def standing_on(self, feet: str) -> NDArray[np.bool_]:
        """Return the samples whose support has this name, e.g. "left_foot" or "left_foot+right_foot", shape (N,)."""
        names = self.samples.support_names
        return np.asarray(self.samples.support == (names.index(feet) if feet in names else -1))


def estimate(walk: Simulated, settings: Settings) -> Estimate:
    """Return the friction torque of every sample that the settings do not trim, and the truth."""
    prepared = prepare(walk.log, walk.robot, settings)
    settings, _ = with_filter(prepared, walk.robot, settings)
    samples = join([chunk.samples for chunk in torque_chunks(prepared, walk.robot, settings)])
    rows = np.searchsorted(walk.log.time, samples.time - samples.period / 2)
    return Estimate(samples, walk.truth.friction_torque[rows][:, walk.robot.torque_controlled])


def rms(values: Array) -> float:
    """Return the root mean square of the values that are known."""
    return float(np.sqrt(np.nanmean(values**2)))
