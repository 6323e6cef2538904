"""What a joint's figures are drawn from: its samples, its law with the 95 % band, its units."""

from dataclasses import dataclass

import numpy as np

from stribeck.friction.law import FrictionLaw
from stribeck.report.reference import NO_REFERENCE, Reference
from stribeck.result import Evidence, JointResult, law_slopes, law_values
from stribeck.samples import Samples
from stribeck.typing import Array

MOST_DRAWN = 100_000
"""Samples of a joint that a figure is drawn from; more change nothing that can be seen."""


@dataclass(frozen=True, eq=False, kw_only=True)
class JointData:
    """A joint's samples and law, ready to draw.

    Attributes
    ----------
    time, velocity, torque
        [s], [rad/s], friction torque [N m] (for prismatic joints m/s and N), shape (N,).
    law, values, covariance
        `values` of shape (p,) and `covariance` of shape (p, p) in the law's order; None where nothing was fitted.
    errors_95
        Standard errors on either side of a value that hold 95 %: more, the fewer blocks the fit saw.
    torque_unit, velocity_unit
        As written on the axes.
    seconds_per_sample
        Time of the log that each of these samples stands for [s].
    reference
        Known from elsewhere: velocity and friction torque there, each of shape (K,).
    """

    time: Array
    velocity: Array
    torque: Array
    law: FrictionLaw
    values: Array | None
    covariance: Array | None
    errors_95: float
    torque_unit: str
    velocity_unit: str
    seconds_per_sample: float
    reference: tuple[Array, Array] | None

    def predict(self, velocity: Array) -> Array | None:
        """Return the law's friction torque at these velocities, shape (N,); None where nothing was fitted."""
        return None if self.values is None else self.law.torque(velocity, self.values)

    def band(self, velocity: Array) -> Array | None:
        """Return half the width of the law's 95 % band, shape (N,), by the delta method: var R = J C J^T."""
        if self.values is None or self.covariance is None or not np.isfinite(self.covariance).all():
            return None
        J = self.law.jacobian(velocity, self.values)
        variance = np.einsum("ni,ij,nj->n", J, self.covariance, J)
        return np.asarray(self.errors_95 * np.sqrt(np.maximum(variance, 0.0)))


def joint_data(
    name: str,
    joint: JointResult,
    evidence: Evidence,
    law: FrictionLaw,
    samples: Samples,
    reference: Reference = NO_REFERENCE,
) -> JointData:
    """Collect what is drawn of a joint, from these samples (all that were kept, or the close-up)."""
    prismatic = name in evidence.prismatic
    time, velocity, torque = _usable(samples, name)
    values, covariance = fitted_values(name, joint, evidence, law)
    return JointData(
        time=time,
        velocity=velocity,
        torque=torque,
        law=law,
        values=values,
        covariance=covariance,
        errors_95=errors_95(joint, law),
        torque_unit="N" if prismatic else "N m",
        velocity_unit="m/s" if prismatic else "rad/s",
        seconds_per_sample=samples.period * samples.stride * _thinning(samples),
        reference=reference.curves.get(name),
    )


def _thinning(samples: Samples) -> int:
    return max(1, -(-len(samples.time) // MOST_DRAWN))


def _usable(samples: Samples, name: str) -> tuple[Array, Array, Array]:
    """Return time, velocity and friction torque of the samples that a fit may use, evenly thinned."""
    if name not in samples.joint_names:
        return np.empty(0), np.empty(0), np.empty(0)
    column = samples.joint_names.index(name)
    thinned = slice(None, None, _thinning(samples))
    velocity = samples.velocity[thinned, column]
    torque = samples.friction_torque[thinned, column]
    keep = samples.usable[thinned, column] & np.isfinite(velocity) & np.isfinite(torque)
    return samples.time[thinned][keep], velocity[keep], torque[keep]


def errors_95(joint: JointResult, law: FrictionLaw) -> float:
    """Return what the intervals of the joint's parameters say; bounds and logarithms may change one of their ends."""
    logarithmic = {parameter.name for parameter in law.parameters if parameter.logarithmic}
    ratios = [
        max(found.interval_95[1] - found.value, found.value - found.interval_95[0]) / found.standard_error
        for name, found in joint.parameters.items()
        if name not in logarithmic and found.standard_error > 0
    ]
    return float(np.median(ratios)) if ratios else 0.0


def fitted_values(
    name: str, joint: JointResult, evidence: Evidence, law: FrictionLaw
) -> tuple[Array | None, Array | None]:
    """Return the law's values and their covariance in the law's order, without what was fitted beside it.

    Of a joint whose friction grows with the load, they are those at its mean load.
    """
    return values_and_covariance(joint, evidence.covariance.get(name), law)


def values_and_covariance(
    joint: JointResult, covariance: Array | None, law: FrictionLaw
) -> tuple[Array | None, Array | None]:
    """Return what `fitted_values` does, given the covariance of the joint's parameters in their order."""
    fitted = {parameter: found.value for parameter, found in joint.parameters.items()}
    load = joint.mean_load or 0.0
    values = law_values(law, fitted, load)
    if values is None or covariance is None or covariance.shape != (len(fitted), len(fitted)):
        return values, None
    slopes = law_slopes(law, fitted, load)
    return values, slopes @ covariance @ slopes.T
