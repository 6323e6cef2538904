"""What errors that come back with every step do to the intervals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import nnls

from stribeck.identification.whole_log.model.friction_curves import Curves
from stribeck.identification.whole_log.model.model_corrections import ModelCorrections
from stribeck.identification.whole_log.solver.normal_equations import NormalEquations
from stribeck.identification.whole_log.solver.solve import Solution, derivatives, inverse_of
from stribeck.typing import Array

LEAST = 6e-4
"""Standard deviation [1], over the root mean square of the friction curves, that is always there: filters make it."""

ROCKING = 1.5
"""How much more feet rock alike in every step than windows show [1]: chosen from offsets in `studies.accuracy`."""

ROUNDS = 5
"""Of weighing what is left over by what has been found [1]: deviations are then within 2 % of where they rest."""


def random_effect_covariance(
    normal_equations: NormalEquations,
    total: int,
    curves: Curves,
    model: ModelCorrections,
    solution: Solution,
    root_turns: Array,
) -> tuple[Array, Array]:
    """Return the repeated errors' standard deviations, shape (n + 3,) or (n,), and what they add to a covariance.

    With A the curvature, Z the repeated errors' columns and Q their variances, an estimate that leaves them out has

        A^-1 + A^-1 (J^T Sigma^-1 Z) Q (J^T Sigma^-1 Z)^T A^-1

    of which the second term is returned.

    Parameters
    ----------
    normal_equations
        Of a share of the log, with the columns Z; without any where there are no steps.
    total
        Number of equations of the whole log.
    curves, model, solution
        Of the whole log, without these errors.
    root_turns
        Standard deviations of the root's angular acceleration [rad/s^2], shape (3,); (0,) for a fixed base. Those of
        the joints' torques [N m] are what the solution leaves over.
    """
    joints = len(curves.top_speed)
    least = LEAST * np.linalg.norm(curves.coefficients(solution.internal)) / np.sqrt(curves.basis.velocity.size)
    effects = joints + len(root_turns)
    gaits = {"gaits": normal_equations.layout.gaits, "gait_effects": normal_equations.layout.gait_effects}
    both = replace(model, layout=replace(model.layout, **gaits))
    layout = replace(solution.layout, **gaits)
    added = layout.part("random_effects")
    columns = added.stop - added.start
    if not columns:
        return np.zeros(effects), np.zeros_like(solution.covariance)
    at = replace(solution, layout=layout, x=np.concatenate([solution.x, np.zeros(columns)]))
    gradient, hessian = derivatives(normal_equations, curves, both, at)
    free = np.flatnonzero(~solution.at_bound)  # friction, which explains what it can of them
    torques = np.arange(layout.size)[added][np.arange(columns) % effects < joints]
    across, own = hessian[np.ix_(free, torques)], hessian[np.ix_(torques, torques)] - np.eye(len(torques))
    explained = np.linalg.solve(hessian[np.ix_(free, free)], across).T
    variance = reml_variances(own - explained @ across, explained @ gradient[free] - gradient[torques], joints)
    level = np.concatenate([np.maximum(np.sqrt(variance), least), ROCKING * root_turns])
    bias = solution.covariance @ hessian[: added.start, added] * (total / normal_equations.count)
    bias *= np.resize(level, columns)
    return level, bias @ bias.T


def reml_variances(information: Array, gradient: Array, joints: int) -> Array:
    """Return the variances of random effects z, those of each joint being alike, shape (n,).

    A log pulls at them by h, with the covariance H + H Q H. By Fisher's scoring of its likelihood (REML; Patterson and
    Thompson 1971), with B = (I + H Q)^-1 H and u = (I + H Q)^-1 h, and sums over the effects of joints i and j,

        sum_j (sum B_kl^2) (Q'_j - Q_j) = sum (u_k^2 - B_kk)

    Few steps say little of one joint's variance, and what chance makes of it would widen its intervals: joints are
    pooled as far as they are alike. No variance is negative.

    Parameters
    ----------
    information, pull
        H, shape (c, c), and h, shape (c,); the joint of an effect is its place modulo n.
    joints
        Number n.
    """
    variance = np.zeros(joints)
    for _ in range(ROUNDS):
        squares, score = _scoring(information, gradient, variance)
        unit = 1 / np.sqrt(np.maximum(np.diag(squares), 1e-300))
        factor = np.linalg.cholesky(squares * np.outer(unit, unit) + 1e-9 * np.eye(joints))
        aim = unit * score + factor @ factor.T @ (variance / unit)
        variance = unit * nnls(factor.T, np.linalg.solve(factor, aim))[0]
    overdispersion = 2 * np.diag(
        _inverse(_scoring(information, gradient, np.zeros(joints))[0])
    )  # if none of them had any
    squares, score = _scoring(information, gradient, variance)
    return np.maximum(partly_pooled(variance + _inverse(squares) @ score, overdispersion), 0.0)


def _scoring(information: Array, gradient: Array, variance: Array) -> tuple[Array, Array]:
    """Return the sums of squares of B, shape (n, n), and the score of each joint's variance, shape (n,)."""
    joints, size = len(variance), len(gradient)
    mixed = np.eye(size) + information * np.tile(variance, size // joints)
    weighed = np.linalg.solve(mixed, np.column_stack([information, gradient]))
    inner, score = weighed[:, :-1], weighed[:, -1] ** 2 - np.diag(weighed)
    squares = (inner**2).reshape(-1, joints, size // joints, joints).sum(axis=(0, 2))
    return squares, score.reshape(-1, joints).sum(axis=0)


def _inverse(squares: Array) -> Array:
    """Return the inverse, as good as none where a joint shows nothing, shape (n, n)."""
    return inverse_of(squares + 1e-9 * np.diag(np.diag(squares) + 1e-12 * np.trace(squares) + 1e-100))


def partly_pooled(values: Array, variances: Array) -> Array:
    """Return values that chance moves apart nearer to their mean, shape (n,), from themselves and their variances.

    How much they differ beyond chance is measured (DerSimonian and Laird 1986); if they do not, all become the mean.
    """
    weight = 1 / variances
    mean = weight @ values / weight.sum()
    beyond = weight @ (values - mean) ** 2 - (len(values) - 1)
    between = max(beyond, 0.0) / max(weight.sum() - weight @ weight / weight.sum(), 1e-300)
    return np.asarray(mean + between / (between + variances) * (values - mean))
