"""Fewer coefficients for the rest of a long log, once a part of it has told the curves nearly (docs/estimator.md).

With A the information of this part on a joint's coefficients theta, and curves theta_1, theta_2, ... drawn around its
estimate, farther away than its intervals reach, the left singular vectors U of A^(1/2) [theta_1, theta_2, ...] make

    theta ~ A^(-1/2) U y,    y = U^T A^(1/2) theta

where what is left out of any of the curves changes chi^2 by less than `REDUCTION_TOLERANCE`, squared.
"""

from dataclasses import replace

import numpy as np
from scipy.sparse import block_diag, eye_array

from stribeck.whole_log.constants import DRAWN_CURVES, DRAWN_STD, REDUCTION_TOLERANCE
from stribeck.whole_log.model.basis import Basis
from stribeck.whole_log.model.friction_curves import Curves
from stribeck.whole_log.solver.normal_equations import NormalEquations
from stribeck.whole_log.solver.solve import Solution


def reduced_basis(part: NormalEquations, curves: Curves, solution: Solution, whole: float) -> Basis:
    """Return the basis with as few coefficients as the curves need that are near a solution.

    Parameters
    ----------
    part, curves, solution
        A part of a log, and the fit to it.
    whole
        How much more there is in the whole log [1].
    """
    joints, per_joint = solution.internal.shape
    normal = np.random.default_rng(0).standard_normal((DRAWN_CURVES, joints, per_joint))
    low, high = curves.bounds
    roots = [np.linalg.cholesky(solution.covariance[own, own]) for own in map(solution.layout.joint, range(joints))]
    drawn = solution.internal + DRAWN_STD * np.einsum("jpq,cjq->cjp", np.stack(roots), normal)
    near = [solution.internal, *np.clip(drawn, low, high)]
    coefficients = np.stack([curves.coefficients(each) for each in near], axis=1).reshape(joints, -1, len(near))
    found = []
    for joint, theta in enumerate(coefficients):
        own = part.layout.joint(joint)
        values, vectors = np.linalg.eigh(whole * part.information[own, own])
        scale = np.sqrt(np.maximum(values, 1e-12 * values[-1]))
        left, _, _ = np.linalg.svd(scale[:, None] * (vectors.T @ theta))
        missed = np.cumsum(((left.T @ (scale[:, None] * (vectors.T @ theta))) ** 2)[::-1], axis=0)[::-1].max(axis=1)
        found.append((int(np.sum(missed > REDUCTION_TOLERANCE**2)), vectors / scale @ left, left.T * scale @ vectors.T))
    count = max(count for count, _, _ in found)
    to = np.stack([more[:, :count] for _, more, _ in found]), np.stack([fewer[:count] for _, _, fewer in found])
    return replace(curves.basis, reduced=to)


def reduced(whole: NormalEquations, basis: Basis) -> NormalEquations:
    """Return normal equations with the fewer coefficients of a basis."""
    assert basis.reduced is not None
    more = basis.reduced[0]
    found = NormalEquations(basis, replace(whole.layout, per_joint=more.shape[2]), whole.alternatives)
    others = eye_array(whole.layout.size - whole.layout.friction.stop)
    columns = block_diag([*more, others], format="csr")
    found.information = np.asarray(columns.T @ (columns.T @ whole.information).T)
    found.right_hand_side = np.asarray(columns.T @ whole.right_hand_side)
    found.windows, found.set_aside = whole.windows, whole.set_aside
    found.square, found.count, found.loads = whole.square, whole.count, whole.loads.copy()
    return found
