"""Fit of one joint: values and their uncertainty."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy  # its special is slow to import: loaded at its first use

from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.friction import FrictionLaw, Parameter
from stribeck.core.judgement.curve_fit.problem import to_internal
from stribeck.core.result import law_values

PRIOR_FACTOR = 100.0
"""Prior standard deviation of a parameter in units of the joint's own torque or speed [1]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class JointFit:
    """Fitted parameters of one joint.

    Attributes
    ----------
    parameters
        Parameters of the law, followed by the armature if it was fitted; p in total.
    values, standard_errors
        Values and standard errors, shape (p,).
    covariance
        Block-robust covariance, shape (p, p).
    intervals
        95 % intervals, clipped at the bounds, shape (p, 2).
    degrees_of_freedom
        Degrees of freedom of each parameter's t quantile, shape (p,).
    at_bound
        Mask of the values at a bound, shape (p,).
    rms
        Root mean square of the training residual [N m].
    samples, blocks
        Number of fitted samples and blocks.
    converged
        Whether the last descent converged; if not, the parameters are hardly distinguishable.
    variance_shares
        Contributions to each parameter's variance by name, with sum one; None if the method does not compute them.
    mean_load
        Mean torque that the joint carries [N m]; friction of the law "auto" can depend on it.
    law_misfit
        Standard error of the resisting torque at the `SPEEDS` due to the law, shape (3,), zero if unknown [N m].
    """

    parameters: tuple[Parameter, ...]
    values: Array
    standard_errors: Array
    covariance: Array
    intervals: Array
    degrees_of_freedom: Array
    at_bound: BoolArray
    rms: float
    samples: int
    blocks: int
    converged: bool
    variance_shares: tuple[dict[str, float], ...] | None = None
    mean_load: float = 0.0
    law_misfit: Array | float = 0.0

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(parameter.name for parameter in self.parameters)

    @property
    def by_name(self) -> dict[str, float]:
        """Values by name of the parameter."""
        return dict(zip(self.names, self.values.tolist(), strict=True))

    def law_values(self, law: FrictionLaw, load: float = 0.0) -> Array:
        """Compute the parameter values of a law under a load [N m], in the order of the law."""
        values = law_values(law, self.by_name, load)
        assert values is not None, "a fit has all parameters that its law needs"
        return values

    def correlation(self, names: Sequence[str]) -> tuple[tuple[float, ...], ...]:
        """Compute the correlation of the errors of some parameters; one without error is correlated with none."""
        columns = [self.names.index(name) for name in names]
        covariance = self.covariance[np.ix_(columns, columns)]
        errors = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        scale = np.divide(1.0, errors, out=np.zeros_like(errors), where=errors > 0)
        correlation = covariance * np.outer(scale, scale)
        np.fill_diagonal(correlation, 1.0)
        return tuple(tuple(row) for row in np.round(correlation.clip(-1.0, 1.0), 6).tolist())


def with_armature(fit: JointFit, inertia: float) -> JointFit:
    """Add the model's rotor inertia [kg m^2] to the fitted one, which is the difference from the model."""
    rotor = np.array([parameter.name == "armature" for parameter in fit.parameters])
    if not rotor.any():
        return fit
    added = inertia * rotor
    parameters = [replace(p, lower=p.lower + more) for p, more in zip(fit.parameters, added.tolist(), strict=True)]
    intervals = fit.intervals + added[:, None]
    return replace(fit, parameters=tuple(parameters), values=fit.values + added, intervals=intervals)


def with_gain_error(fit: JointFit, error: float) -> JointFit:
    """Add the relative standard error [1] of the torques' gain, which scales all friction, to the errors of a fit."""
    scaled = fit.values * np.array([parameter.unit.startswith(("N", "kg")) for parameter in fit.parameters])
    if error == 0 or not scaled.any():
        return fit
    covariance = fit.covariance + error**2 * np.outer(scaled, scaled)
    factor = np.sqrt(np.diag(covariance) / np.maximum(np.diag(fit.covariance), 1e-300))
    factor = np.where(scaled == 0, 1.0, factor)
    bounds = np.array([(parameter.lower, parameter.upper) for parameter in fit.parameters])
    intervals = np.clip(
        fit.values[:, None] + factor[:, None] * (fit.intervals - fit.values[:, None]), *bounds.T[..., None]
    )
    return replace(fit, covariance=covariance, standard_errors=fit.standard_errors * factor, intervals=intervals)


def without_friction(fit: JointFit) -> JointFit:
    """Set Coulomb and viscous friction to zero, for a joint whose friction is that of couplings."""
    kept = np.array([not parameter.name.startswith(("coulomb", "viscous")) for parameter in fit.parameters])
    values, errors, intervals = fit.values * kept, fit.standard_errors * kept, fit.intervals * kept[:, None]
    covariance = fit.covariance * np.outer(kept, kept)
    fit = replace(fit, values=values, standard_errors=errors, intervals=intervals)
    return replace(fit, covariance=covariance, law_misfit=0.0)


def in_channel_unit(fit: JointFit, gain: float) -> JointFit:
    """Divide a fit by the rough gain that its torques were multiplied by.

    A rotor inertia is left out: only its sum with the model's inertia, which the gain scales, is known. The error of
    the offset includes the mean load for the same reason.
    """
    kept = np.array([parameter.name != "armature" for parameter in fit.parameters])
    parameters = tuple(parameter for parameter, flag in zip(fit.parameters, kept, strict=True) if flag)
    factor = np.array([1 / gain if parameter.unit.startswith("N") else 1.0 for parameter in parameters])
    values, ends = factor * fit.values[kept], factor[:, None] * fit.intervals[kept]
    covariance = fit.covariance[np.ix_(kept, kept)] * np.outer(factor, factor)
    errors = np.sqrt(np.diag(covariance))
    offset = np.array([parameter.name == "offset" for parameter in parameters])
    covariance[offset, offset] += (fit.mean_load / gain) ** 2
    widened = np.sqrt(np.diag(covariance)) / np.maximum(errors, 1e-300)
    shares = fit.variance_shares and tuple(share for share, flag in zip(fit.variance_shares, kept, strict=True) if flag)
    return replace(
        fit,
        parameters=parameters,
        values=values,
        standard_errors=factor * fit.standard_errors[kept] * widened,
        covariance=covariance,
        intervals=values[:, None] + np.where(offset, widened, 1.0)[:, None] * (ends - values[:, None]),
        degrees_of_freedom=fit.degrees_of_freedom[kept],
        at_bound=fit.at_bound[kept],
        rms=fit.rms / gain,
        variance_shares=shares,
        mean_load=fit.mean_load / gain,
        law_misfit=fit.law_misfit / gain,
    )


def near_bound(parameters: tuple[Parameter, ...], values: Array, deviation: Array, units: Array) -> BoolArray:
    """Find the values that are within 1 % of a standard error of a bound, shape (p,).

    `deviation` and `units` refer to internal coordinates. Without information about a parameter its unit is used
    instead of the standard error.
    """
    logs = np.array([parameter.logarithmic for parameter in parameters])
    bounds = np.array([(parameter.lower, parameter.upper) for parameter in parameters])
    distance = np.min(np.abs(to_internal(values, logs) - to_internal(bounds.T, logs)), axis=0)
    return np.asarray(distance < 0.01 * np.minimum(deviation, units))


def parameter_units(parameters: tuple[Parameter, ...], torque: float, speed: float, acceleration: float = 1.0) -> Array:
    """Choose a typical size of each parameter from the joint's torque and speed, shape (p,); 1 for logarithms."""
    units = {"N m": torque, "N m s/rad": torque / speed, "kg m^2": torque / acceleration, "rad/s": speed}
    return np.array([1.0 if parameter.logarithmic else units.get(parameter.unit, 1.0) for parameter in parameters])


def intervals_95(values: Array, deviation: Array, freedom: Array, logarithmic: BoolArray) -> Array:
    """Compute 95 % intervals, shape (p, 2).

    `deviation` is the standard error of each parameter, or of its logarithm where `logarithmic`.
    """
    half = scipy.special.stdtrit(freedom, 0.975) * deviation
    factor = np.exp(np.minimum(half, 100.0))
    lower = np.where(logarithmic, values / factor, values - half)
    upper = np.where(logarithmic, values * factor, values + half)
    return np.column_stack([lower, upper])
