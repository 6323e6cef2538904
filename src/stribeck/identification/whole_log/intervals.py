"""What the whole log says about each joint, in the form that verdicts are made from."""

from __future__ import annotations

import numpy as np

from stribeck.identification.curve_fit.covariance import intervals_95
from stribeck.identification.curve_fit.descent import to_external, to_internal
from stribeck.identification.curve_fit.problem import ARMATURE
from stribeck.identification.joint_fit import AT_BOUND, JointFit
from stribeck.identification.whole_log.choose import FOLDS
from stribeck.identification.whole_log.estimate import WholeLogFit
from stribeck.identification.whole_log.model import ROTOR


def joint_fits(fit: WholeLogFit, names: tuple[str, ...]) -> dict[str, JointFit]:
    """Return the fits of all joints by name.

    The covariance is the inverse curvature of all coordinates together, so that what is not known of the model widens
    the friction's intervals; it is scaled where errors are larger than they were taken to be, or parts of the log
    disagree about a joint. A gain that all torques share scales all friction.
    """
    freedom = max(fit.stretches - 1.0, 1.0)
    return {name: _joint_fit(fit, k, freedom, len(names)) for k, name in enumerate(names)}


def _joint_fit(fit: WholeLogFit, joint: int, freedom: float, joints: int) -> JointFit:
    solution, there = fit.solution, fit.model.corrections
    has = np.flatnonzero(fit.curves.has(joint))
    own = (joint * len(fit.curves.parameters) + has).tolist()
    parameters = tuple(fit.curves.parameters[k] for k in has)
    coordinates, share, held = solution.internal[joint, has], np.ones(len(has)), solution.held[joint, has]
    wider = np.sqrt(np.maximum(fit.widening, fit.differing[joint, has]))
    degrees = np.where(fit.differing[joint, has] > fit.widening, min(freedom, FOLDS - 1), freedom)
    if joint in there.rotors:
        place = there.size - len(there.rotors) + there.rotors.index(joint)
        own.append(solution.internal.size + place)
        parameters, rotor = (*parameters, ARMATURE), solution.corrections[place]
        coordinates = np.append(coordinates, max(rotor, 0.0))
        share, held = np.append(share, ROTOR), np.append(held, rotor <= 0)
        wider, degrees = np.append(wider, np.sqrt(fit.widening)), np.append(degrees, freedom)
    logs = np.array([parameter.logarithmic for parameter in parameters])
    bounds = np.array([(parameter.lower, parameter.upper) for parameter in parameters])
    covariance = solution.covariance[np.ix_(own, own)] * np.outer(wider * share, wider * share)
    values = to_external(coordinates, logs) * share
    torques = np.array([parameter.unit.startswith(("N m", "kg m^2")) for parameter in parameters])
    scaled = fit.model.common_gain * np.where(torques, np.where(logs, 1.0, values), 0.0)
    covariance += np.outer(scaled, scaled)
    deviation = np.sqrt(np.diag(covariance))
    factor = np.where(logs, values, 1.0)
    distance = np.min(np.abs(to_internal(values, logs) - to_internal(bounds.T, logs)), axis=0)
    return JointFit(
        parameters=parameters,
        values=values,
        standard_errors=deviation * factor,
        covariance=covariance * np.outer(factor, factor),
        intervals=np.clip(intervals_95(values, deviation, degrees, logs), bounds[:, :1], bounds[:, 1:]),
        degrees_of_freedom=degrees,
        at_bound=held | (distance < AT_BOUND * deviation),
        rms=float(fit.residual_rms[joint]),
        samples=fit.statistic.count // joints,
        blocks=fit.stretches,
        starts=2,
        cost=solution.cost,
        converged=solution.settled,
    )
