"""Estimated and true friction torque of a simulated walk, sample by sample."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stribeck import Settings
from stribeck.core.base.typing import Array
from stribeck.core.equations.friction_torque.inverse_dynamics import torque_chunks
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.equations.friction_torque.stage import with_filter
from stribeck.core.equations.friction_torque.thinning import join
from stribeck.core.filters.averaging import implied_weights
from stribeck.core.filters.filters import Filter, finite_filter
from stribeck.core.friction import get_law
from stribeck.core.judgement.curve_fit.problem import joint_problem
from stribeck.core.result.samples import FrictionSamples
from stribeck.core.settings import FilterSettings, SupportSettings
from stribeck.paper.curve_fit.fit import fit_joint, part_of
from stribeck.paper.filters.butterworth import central_kernels
from stribeck.simulation.run import Simulated

UNTRIMMED = SupportSettings(trim_start=0.0, trim_end=0.0)
"""Support settings for the ideal simulator, whose feet touch down without an impact."""
EXACT = FilterSettings(kind="log")
"""Filter settings that take velocity and acceleration from an ideal log."""


class Differences(FilterSettings):
    """Finite differences (6.2), (6.3) over five samples instead of a filter.

    The delay of backward differences remains, as in a real-time system, or is compensated (6.1.2).
    """

    kind: Literal["auto", "savitzky-golay", "butterworth", "log"] = "savitzky-golay"
    window: int | None = 5
    scheme: Literal["central", "backward", "backward, compensated"]

    def filter(self, period: float) -> Filter:
        """Build the filter of the scheme."""
        if self.scheme == "central":
            kernels = central_kernels(period)
            return finite_filter(self.scheme, kernels, implied_weights(kernels[2], period))
        kernels = backward_kernels(period, self.scheme.endswith("compensated"))
        return finite_filter(self.scheme, kernels, kernels[0])


def backward_kernels(period: float, compensate_delay: bool) -> Array:
    """Compute the kernels of position, velocity and acceleration, shape (3, 5), by (6.3) once and twice.

    A backward difference estimates the velocity half a period earlier, and its backward difference the acceleration one
    period earlier. Without compensation, both are used as current values. With compensation, all signals refer to the
    same sample (6.1.2): the acceleration is shifted by one period, and the velocity is the mean of the differences half
    a period before and after the sample.
    """
    present = np.array([0.0, 0.0, 1.0, 0.0, 0.0])
    if compensate_delay:
        velocity = np.array([0.0, -0.5, 0.0, 0.5, 0.0]) / period
        acceleration = np.array([0.0, 1.0, -2.0, 1.0, 0.0]) / period**2
    else:
        velocity = np.array([0.0, -1.0, 1.0, 0.0, 0.0]) / period
        acceleration = np.array([1.0, -2.0, 1.0, 0.0, 0.0]) / period**2
    return np.array([present, velocity, acceleration])


@dataclass(frozen=True, eq=False)
class Estimate:
    """Estimated friction torque, and the ground truth at the same samples and joints, shape (N, n) [N m]."""

    samples: FrictionSamples
    truth: Array

    @property
    def error(self) -> Array:
        """Estimate minus ground truth [N m], shape (N, n); NaN without an estimate."""
        return np.asarray(self.samples.friction_torque - self.truth)

    def column(self, joint: str) -> int:
        """Find the column of a joint."""
        return self.samples.joint_names.index(joint)

    def standing_on(self, feet: str) -> NDArray[np.bool_]:
        """Select the samples with this support, e.g. "left_foot" or "left_foot+right_foot", shape (N,)."""
        names = self.samples.support_names
        return np.asarray(self.samples.support == (names.index(feet) if feet in names else -1))


def estimate(walk: Simulated, settings: Settings) -> Estimate:
    """Estimate the friction torque of every sample that the settings do not trim; add the ground truth."""
    prepared = prepare(walk.log, walk.robot, settings)
    settings, _ = with_filter(prepared, walk.robot, settings)
    scheme = settings.filter
    motion_filter = scheme.filter(prepared.sampling.period) if isinstance(scheme, Differences) else None
    chunks = torque_chunks(prepared, walk.robot, settings, motion_filter=motion_filter)
    samples = join([chunk.samples for chunk in chunks])
    rows = np.searchsorted(walk.log.time, samples.time - samples.period / 2)
    return Estimate(samples, walk.truth.friction_torque[rows][:, walk.robot.torque_controlled])


def fit_law(found: Estimate, joint: str, settings: Settings, most: int | None = None) -> tuple[dict[str, float], Array]:
    """Fit the law `stribeck` to at most `most` samples of a joint; return its parameters and the velocities."""
    problem = joint_problem(found.samples, joint, get_law("stribeck"), settings)
    if most:
        problem = part_of(problem, slice(None, None, -(-len(problem.velocity) // most)))
    fit = fit_joint(problem)
    return dict(zip(fit.names, map(float, fit.values), strict=True)), problem.velocity


def rms(values: Array) -> float:
    """Compute the root mean square of all values except NaN."""
    return float(np.sqrt(np.nanmean(values**2)))
