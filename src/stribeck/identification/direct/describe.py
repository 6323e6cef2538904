"""What was found, joint by joint and body by body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stribeck.friction import Parameter
from stribeck.identification.curve_fit.covariance import intervals_95
from stribeck.identification.direct.estimate import DirectFit
from stribeck.identification.direct.rows import DirectRows
from stribeck.identification.joint_fit import JointFit, near_bound
from stribeck.identification.judgement.excitation import MIN_BLOCKS, MIN_SAMPLES_PER_PARAMETER
from stribeck.identification.whole_log.describe import body_correction
from stribeck.inertial_parameters import SIZE
from stribeck.result import BodyCorrection
from stribeck.typing import Array


@dataclass(frozen=True, eq=False, kw_only=True)
class JointColumns:
    """The friction coefficients of a joint or coupling.

    Attributes
    ----------
    name, parameters
        Of the p coefficients: the law's, then the armature if it is fitted.
    first
        The first of them among all.
    units
        A sensible unit of each by what the joint does [its own], shape (p,).
    kinds
        Of the rows that its friction acts on.
    """

    name: str
    parameters: tuple[Parameter, ...]
    first: int
    units: Array
    kinds: tuple[int, ...]


def joint_fits(fit: DirectFit, joints: Sequence[JointColumns], rows: Sequence[DirectRows]) -> dict[str, JointFit]:
    """Return the fit of each joint that moves long enough in the rows; up to half of its blocks may be held out."""
    found = {}
    for joint in joints:
        samples, blocks = _counts(rows, joint)
        if 2 * blocks >= MIN_BLOCKS and samples >= MIN_SAMPLES_PER_PARAMETER * len(joint.parameters):
            found[joint.name] = _joint_fit(fit, joint, samples, blocks)
    return found


def _counts(rows: Sequence[DirectRows], joint: JointColumns) -> tuple[int, int]:
    """Return in how many samples and blocks all rows count that a joint's friction acts on."""
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


def body_corrections(fit: DirectFit, names: Sequence[str], model: Array) -> dict[str, BodyCorrection]:
    """Return the correction of each body that the model has a mass of, from its parameters there, shape (L, 10)."""
    found = {}
    for k, name in enumerate(names):
        before, after = model[k], model[k] + fit.change[k]
        if before[0] > 0:
            own = slice(SIZE * k, SIZE * k + 4)
            # of the mass, and of c = (m c) / m: dc = (d(m c) - c dm) / m
            slopes = np.column_stack([-after[1:4] / after[0], np.eye(3)]) / after[0]
            of_mass = fit.covariance[own, own]
            centre = np.sqrt(np.diag(slopes @ of_mass @ slopes.T))
            found[name] = body_correction(before, after, float(np.sqrt(of_mass[0, 0])), centre, float(fit.known[k]))
    return found
