"""Validation on held-out segments (docs/estimator-fit.md, "Accumulation")."""

from collections.abc import Sequence

import numpy as np
import scipy  # its linalg is slow to import: loaded at its first use

from stribeck.core.base.typing import Array
from stribeck.core.equations.weak_equations import WeakEquations
from stribeck.core.estimator.model.terms import Columns
from stribeck.core.estimator.reading import Reading
from stribeck.core.estimator.solver.statistics import Statistics
from stribeck.core.result import Validation


def validate(read: Reading, values: Array) -> tuple[Validation | None, ...]:
    """Validate each joint on the held-out segments, in the order of the equations' joints; None without segments.

    `values` are coefficients and corrections of a fit to the other segments, shape (D,). It is compared with a fit of
    Coulomb friction and offset.
    """
    if not read.unseen:
        return (None,) * len(read.columns.basis.velocity)
    f = read.known.friction
    coulomb = coulomb_curves(read.known, read.columns, values[f:], read.unseen[0].joints)
    rms = friction_residual_rms(read, read.unseen, values, np.stack([values[:f], np.zeros(f), coulomb]))
    return tuple(
        Validation(rms=float(law), rms_zero_friction=float(zero), rms_coulomb_only=float(only))
        for law, zero, only in rms.T
    )


def friction_residual_rms(read: Reading, equations: Sequence[WeakEquations], values: Array, candidates: Array) -> Array:
    """Compute the residual of each joint's friction torque, root mean square [N m], shape (candidates, n).

    Each equation is weighted by P_ki^2 / var(e_k), which is its information on joint i. `values`, shape (D,), are the
    coefficients and corrections, and each candidate, a row of shape (f,), replaces one joint's coefficients at a time.
    """
    columns, components = read.columns, read.pilot.components
    joints, friction = len(columns.basis.velocity), candidates.shape[1]
    squares, weights = np.zeros((len(candidates), joints)), np.zeros(joints)
    changes = (values[:friction] - candidates).reshape(len(candidates), joints, -1)
    for part in equations:
        by_joint = columns.by_joint(part)
        residual = part.residual.ravel() - columns.design(part, by_joint) @ values
        share = part.weights**2 / components.marginal(part)[:, :, None] * part.used[:, None, None]
        share = share.reshape(-1, joints)
        weights += share.sum(axis=0)
        for k, torque in enumerate(np.einsum("kjr,cjr->ckj", by_joint, changes)):
            error = residual[:, None] + (part.weights * torque[:, None]).reshape(-1, joints)
            squares[k] += (share * error**2).sum(axis=0)
    return np.asarray(np.sqrt(squares / np.maximum(weights, 1e-300)))


def coulomb_curves(statistics: Statistics, columns: Columns, corrections: Array, joints: int) -> Array:
    """Fit Coulomb friction and offset of all joints, and return their coefficients [N m], shape (f,).

    The first `joints` have offsets; the couplings after them do not.
    """
    basis, f, zeros = columns.basis, statistics.friction, np.zeros((columns.terms.size, 2))
    curves = [
        np.vstack([basis.functions.T @ np.column_stack([np.sign(v), np.full_like(v, k < joints)]), zeros])
        for k, v in enumerate(basis.velocity)
    ]
    whole = scipy.linalg.block_diag(*curves)
    matrix = whole.T @ statistics.information[:f, :f] @ whole
    vector = whole.T @ (statistics.right[:f] - statistics.information[:f, f:] @ corrections)
    ridge = 1e-9 * float(np.diag(matrix).max()) * np.eye(len(matrix))
    return np.asarray(whole @ np.linalg.solve(matrix + ridge, vector))
