"""Description of the estimate per joint and body."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stribeck.base.typing import Array
from stribeck.friction import Parameter
from stribeck.judgement.curve_fit.covariance import intervals_95
from stribeck.judgement.excitation import MIN_BLOCKS, MIN_SAMPLES_PER_PARAMETER
from stribeck.judgement.joint_fit import JointFit, near_bound
from stribeck.methods.direct.estimate import DirectFit
from stribeck.methods.direct.rows import DirectRows
from stribeck.result import BODY_COORDINATES, Corrections
from stribeck.robot.inertial_parameters import SIZE, log_cholesky, pseudo_inertia
from stribeck.whole_log.describe import body_correction
from stribeck.whole_log.uncertainty.joint_errors import told_correlations

STEP = 1e-4
"""Step of finite differences in standard errors [1]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class JointColumns:
    """The friction coefficients of a joint or coupling.

    Attributes
    ----------
    name, parameters
        Name of the joint, and its p parameters: first of the law, then the armature if it is fitted.
    first
        Index of the first coefficient among all.
    units
        Typical size of each parameter, shape (p,).
    kinds
        Kinds of the rows on which the friction acts.
    """

    name: str
    parameters: tuple[Parameter, ...]
    first: int
    units: Array
    kinds: tuple[int, ...]


def joint_fits(fit: DirectFit, joints: Sequence[JointColumns], rows: Sequence[DirectRows]) -> dict[str, JointFit]:
    """Describe the fit of each joint that moves long enough; up to half of its blocks can be held out."""
    found = {}
    for joint in joints:
        samples, blocks = _counts(rows, joint)
        if 2 * blocks >= MIN_BLOCKS and samples >= MIN_SAMPLES_PER_PARAMETER * len(joint.parameters):
            found[joint.name] = _joint_fit(fit, joint, samples, blocks)
    return found


def _counts(rows: Sequence[DirectRows], joint: JointColumns) -> tuple[int, int]:
    """Count the samples and blocks in which all rows of a joint's friction are used."""
    there = [own for own in rows if np.isin(joint.kinds, own.kind).all()]
    blocks = [own.clusters[0, own.used[:, np.isin(own.kind, joint.kinds)].all(axis=1)] for own in there]
    return sum(len(each) for each in blocks), len({*(number for each in blocks for number in each.tolist())})


def _joint_fit(fit: DirectFit, joint: JointColumns, samples: int, blocks: int) -> JointFit:
    own = slice(joint.first, joint.first + len(joint.parameters))
    of_all = slice(fit.change.size + own.start, fit.change.size + own.stop)
    values, covariance = fit.coefficients[own], fit.covariance[of_all, of_all]
    errors, freedom = np.sqrt(np.diag(covariance)), fit.freedom[of_all]
    bounds = np.array([(each.lower, each.upper) for each in joint.parameters])
    intervals = intervals_95(values, errors, freedom, np.zeros(len(values), dtype=bool))
    return JointFit(
        parameters=joint.parameters,
        values=values,
        standard_errors=errors,
        covariance=covariance,
        intervals=np.clip(intervals, bounds[:, :1], bounds[:, 1:]),
        degrees_of_freedom=freedom,
        at_bound=fit.held[own] | near_bound(joint.parameters, values, errors, joint.units),
        rms=float(np.linalg.norm(fit.deviation[list(joint.kinds)])),
        samples=samples,
        blocks=blocks,
        converged=fit.converged,
    )


def corrections(fit: DirectFit, joints: Sequence[JointColumns], names: Sequence[str], model: Array) -> Corrections:
    """Describe the corrections, given the parameters of the bodies in the model, shape (L, 10).

    Massless bodies are omitted, and so are shape errors at the limit of physically possible shapes.
    """
    turn, kept = np.eye(len(fit.covariance)), [k for k in range(len(names)) if model[k, 0] > 0]
    told = {}  # number of coordinates per body
    for k in kept:
        own = slice(SIZE * k, SIZE * (k + 1))
        slopes = _slopes(model[k] + fit.change[k], np.sqrt(np.diag(fit.covariance)[own]))
        told[k] = SIZE if np.isfinite(slopes).all() else 4  # mass and center, without the shape
        turn[own, own][: told[k]] = slopes[: told[k]]
    covariance = turn @ fit.covariance @ turn.T
    errors = np.sqrt(np.diag(covariance))
    bodies = {}
    for k in kept:
        mass, after = float(np.sqrt(fit.covariance[SIZE * k, SIZE * k])), model[k] + fit.change[k]
        centre, shape = (errors[SIZE * k + first : SIZE * k + last] for first, last in ((1, 4), (4, SIZE)))
        said = tuple(shape.tolist()) if told[k] == SIZE else None
        bodies[names[k]] = body_correction(model[k], after, mass, centre, float(fit.known[k]), said)
    places = [fit.change.size + joint.first + k for joint in joints for k in range(len(joint.parameters))]
    places += [SIZE * k + coordinate for k in kept for coordinate in range(told[k])]
    return Corrections(
        chi_square=1.0,
        disagreement=fit.overdispersion,
        bodies=bodies,
        correlations=told_correlations(
            covariance[np.ix_(places, places)],
            [f"{joint.name}.{parameter.name}" for joint in joints for parameter in joint.parameters],
            [f"{names[k]}.{coordinate}" for k in kept for coordinate in BODY_COORDINATES[: told[k]]],
        ),
    )


def _slopes(parameters: Array, errors: Array) -> Array:
    """Compute the derivatives of a body's log-Cholesky coordinates with respect to its parameters, shape (10, 10)."""
    steps = STEP * np.diag(errors)
    ahead, behind = (log_cholesky(pseudo_inertia(parameters + sign * steps)) for sign in (1, -1))
    return np.asarray((ahead - behind).T / (2 * STEP * errors))
