"""Validation on held-out segments (docs/estimator.md, "Validation and verdicts")."""

from collections.abc import Sequence

import numpy as np
from scipy.linalg import block_diag

from stribeck.base.typing import Array
from stribeck.result import Validation
from stribeck.whole_log.model.basis import Basis
from stribeck.whole_log.model.friction_curves import Curves
from stribeck.whole_log.noise.variance_components import VarianceComponents
from stribeck.whole_log.solver.normal_equations import NormalEquations, curve_windows, design
from stribeck.whole_log.weak_equations import WeakEquations


def validate(
    held_out: Sequence[WeakEquations],
    training: NormalEquations,
    curves: Curves,
    components: VarianceComponents,
    friction: Array,
    corrections: Array,
) -> tuple[Validation | None, ...]:
    """Return a validation for each joint, in the order of the equations' joints; None where nothing is held out.

    Parameters
    ----------
    held_out
        Equations that the fit did not use.
    training
        Those that it used: for the Coulomb friction and offset that the law is compared with.
    curves, components
        Basis, and variance components that equations are weighted by.
    friction, corrections
        Coefficients of the curves [N m], shape (n r,), and corrections, shape (c,), that the training gave.
    """
    if not held_out:
        return (None,) * len(curves.top_speed)
    candidates = np.stack(
        [friction, np.zeros_like(friction), coulomb_curves(training, corrections, held_out[0].joints)]
    )
    rms = friction_residual_rms(held_out, curves, components, friction, corrections, candidates)
    return tuple(
        Validation(rms=float(own), rms_zero_friction=float(zero), rms_coulomb_only=float(coulomb))
        for own, zero, coulomb in rms.T
    )


def friction_residual_rms(
    equations: Sequence[WeakEquations],
    curves: Curves,
    components: VarianceComponents,
    friction: Array,
    corrections: Array,
    candidates: Array,
) -> Array:
    """Return the residual of each joint's friction torque, root mean square [N m], shape (candidates, n).

    Each equation is weighted by P_ki^2 / var(e_k), which is its information on joint i. `friction`, shape (n r,), are
    the other joints' curves, and each candidate, a row of shape (n r,), stands in for one joint's at a time.
    """
    joints = len(curves.top_speed)
    squares, weights = np.zeros((len(candidates), joints)), np.zeros(joints)
    for part in equations:
        residual = remaining(part, curves.basis, friction, corrections).ravel()
        share = _shares(part, components)
        weights += share.sum(axis=0)
        windows = curve_windows(part, curves.basis)
        changes = (friction - candidates).reshape(len(candidates), joints, -1)
        for k, torque in enumerate(np.einsum("kjr,cjr->ckj", windows, changes)):
            error = residual[:, None] + (part.weights * torque[:, None]).reshape(-1, joints)
            squares[k] += (share * error**2).sum(axis=0)
    return np.asarray(np.sqrt(squares / np.maximum(weights, 1e-300)))


def remaining(equations: WeakEquations, basis: Basis, friction: Array, corrections: Array) -> Array:
    """Return what coefficients of curves and corrections leave of the equations, shape (K, m)."""
    fitted = design(equations, basis) @ np.concatenate([friction, corrections])
    return np.asarray(equations.residual - fitted.reshape(equations.residual.shape))


def coulomb_curves(normal_equations: NormalEquations, corrections: Array, joints: int) -> Array:
    """Return the coefficients of the best Coulomb friction and offset of all joints [N m], shape (n r,).

    The first `joints` have offsets; couplings, behind them, have none.
    """
    basis, friction, model = normal_equations.basis, normal_equations.layout.friction, normal_equations.layout.model
    columns = [
        basis.coefficients(np.column_stack([np.sign(v), np.full_like(v, k < joints)]))
        for k, v in enumerate(basis.velocity)
    ]
    whole = block_diag(*columns)
    matrix = whole.T @ normal_equations.information[friction, friction] @ whole
    vector = whole.T @ (
        normal_equations.right_hand_side[friction] - normal_equations.information[friction, model] @ corrections
    )
    ridge = 1e-9 * float(np.diag(matrix).max()) * np.eye(len(matrix))
    return np.asarray(whole @ np.linalg.solve(matrix + ridge, vector))


def _shares(equations: WeakEquations, components: VarianceComponents) -> Array:
    """Return each equation's information on each joint's friction torque [1/(N m)^2], shape (K m, n)."""
    shares = equations.weights**2 / components.marginal(equations)[:, :, None]
    shares *= equations.used[:, None, None]
    return np.asarray(shares.reshape(-1, shares.shape[2]))
