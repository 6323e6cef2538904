"""Fits of single joints with their intervals, from the covariance budget (docs/estimator-fit.md, "Intervals")."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.core.equations.constants import FOLDS
from stribeck.core.estimator.estimate import WholeLogFit
from stribeck.core.friction import Parameter
from stribeck.core.judgement.curve_fit.problem import ARMATURE, to_external
from stribeck.core.judgement.joint_fit import JointFit, intervals_95, near_bound, parameter_units, without_friction


def joint_fits(fit: WholeLogFit) -> dict[str, JointFit]:
    """Compute the fits of all joints by name.

    The covariance includes all coordinates, so that the uncertainty of the model widens friction's
    intervals, and the heterogeneity over folds. A gain that all torque sensors share scales all friction.
    """
    most = 2 * (FOLDS - 1)  # of D: the folds of a joint, and of all joints
    freedom = float(np.clip(len(fit.read.windows) - 1, 1, most))
    fits = {name: _joint_fit(fit, k, freedom) for k, name in enumerate(fit.joints)}
    return fits | {name: without_friction(fits[name]) for name in fit.robot.bare & fits.keys()}


@dataclass(frozen=True, eq=False, kw_only=True)
class JointCoordinates:
    """The k coordinates of a joint's friction, and of its rotor if that is fitted.

    Attributes
    ----------
    places, unit
        Indices in the parameter vector, and the unit of each coordinate, shape (k,) each.
    parameters, values
        Names of the parameters, and their values, shape (k,).
    held
        Mask of coordinates at a bound, shape (k,).
    gain
        Standard deviations due to a gain common to all torques, shape (k,).
    """

    places: NDArray[np.int64]
    unit: Array
    parameters: tuple[Parameter, ...]
    values: Array
    held: NDArray[np.bool_]
    gain: Array


def joint_coordinates(fit: WholeLogFit, joint: int) -> JointCoordinates:
    """Collect the coordinates of a joint."""
    inner, model, layout = fit.fit, fit.fit.model, fit.fit.layout
    has = np.flatnonzero(inner.laws.free[joint])
    places, unit = layout.joint(joint).start + has, np.ones(len(has))
    parameters = tuple(inner.laws.parameters[k] for k in has)
    held = inner.at_bound[joint, has]
    if joint in layout.rotors:
        number = layout.rotors.index(joint)
        places = np.append(places, layout.part("rotors").start + number)
        unit = np.append(unit, model.scales[places[-1] - layout.part("bodies").stop])
        rotor = replace(ARMATURE, lower=0.0 - float(layout.armature[number]))
        parameters = (*parameters, rotor)
        held = np.append(held, inner.x[places[-1]] * unit[-1] <= rotor.lower)
    logs = np.array([parameter.logarithmic for parameter in parameters])
    least = np.array([p.lower if p.name == ARMATURE.name else -np.inf for p in parameters])  # held almost there
    values = np.maximum(to_external(inner.x[places], logs) * unit, least)
    torques = np.array([parameter.unit.startswith(("N m", "kg m^2")) for parameter in parameters])
    gain = model.common_gain * np.where(torques, np.where(logs, 1.0, values), 0.0) / unit
    return JointCoordinates(places=places, unit=unit, parameters=parameters, values=values, held=held, gain=gain)


def _joint_fit(fit: WholeLogFit, joint: int, freedom: float) -> JointFit:
    coordinates = joint_coordinates(fit, joint)
    parameters, values, unit = coordinates.parameters, coordinates.values, coordinates.unit
    degrees = np.full(len(values), freedom)
    logs = np.array([parameter.logarithmic for parameter in parameters])
    bounds = np.array([(parameter.lower, parameter.upper) for parameter in parameters])
    terms = fit.budget.terms(coordinates.places, coordinates.gain)
    covariance = np.sum(list(terms.values()), axis=0) * np.outer(unit, unit)
    deviation = np.sqrt(np.diag(covariance))
    shares = {name: np.diag(term) * unit**2 / deviation**2 for name, term in terms.items()}
    factor = np.where(logs, values, 1.0)
    units = parameter_units(parameters, float(fit.fit.laws.torque[joint]), float(fit.fit.laws.top_speed[joint]))
    return JointFit(
        parameters=parameters,
        values=values,
        standard_errors=deviation * factor,
        covariance=covariance * np.outer(factor, factor),
        intervals=np.clip(intervals_95(values, deviation, degrees, logs), bounds[:, :1], bounds[:, 1:]),
        degrees_of_freedom=degrees,
        at_bound=coordinates.held | near_bound(parameters, values, deviation, units),
        rms=float(fit.residual_rms[joint]),
        samples=fit.read.whole.count // len(fit.joints),
        blocks=len(fit.read.windows),
        converged=fit.fit.converged,
        variance_shares=tuple({name: float(share[k]) for name, share in shares.items()} for k in range(len(unit))),
        mean_load=float(fit.read.whole.mean_load[joint]) if fit.terms else 0.0,
        law_misfit=fit.law_misfits[joint],
    )
