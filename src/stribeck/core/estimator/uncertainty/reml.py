"""Variances of the gait-phase random effects by REML, and their part of the covariance.

A rocking foot leaves hardly any residual, because corrections of centers of mass absorb it. The standard deviation of
the root's random effect is therefore assumed: `ROOT_EFFECT_FACTOR` times its deviation from window to window.

Equations (29) to (32) of docs/estimator-fit.md (Patterson and Thompson 1971; DerSimonian and Laird 1986).
"""

import numpy as np
import scipy  # its optimize is slow to import: loaded at its first use

from stribeck.core.base.typing import Array
from stribeck.core.equations.constants import ROOT_EFFECT_FACTOR
from stribeck.core.estimator.solver.elimination import times_blocks
from stribeck.core.estimator.solver.fit import Fit
from stribeck.core.estimator.solver.positive_definite import inverse_of
from stribeck.core.estimator.solver.statistics import Statistics


def random_effect_covariance(
    sample: Statistics, count: int, fit: Fit, root_turns: Array, largest: Array | float = np.inf
) -> tuple[Array, Array]:
    """Estimate the random effects' standard deviations, shape (n + 3,) or (n,), and their share of the covariance.

    With C the inverse curvature, Z the random effects' columns and Q their variances, a fit without them has

        C + C (J^T X^T Sigma^-1 Z) Q (J^T X^T Sigma^-1 Z)^T C

    The second term is returned: equation (29).

    Parameters
    ----------
    sample
        Sample of the log with the columns Z, which are missing without steps.
    count
        Number of equations of the whole log.
    fit
        Fit to the whole log, without random effects.
    root_turns
        Standard deviations of the root's angular acceleration [rad/s^2], shape (3,); (0,) for a fixed base. The joints'
        torques [N m] are estimated from the residuals.
    largest
        Largest standard deviations of the joints' torques [N m], shape (n,): few steps say little about them, but no
        effect is larger than the residual that it is a part of.
    """
    joints, friction = len(fit.internal), fit.internal.size
    functions = fit.laws.basis.functions.shape[1]
    level = np.linalg.norm(fit.laws.coefficients(fit.internal)[:, :functions])
    least = 6e-4 * level / np.sqrt(fit.laws.basis.velocity.size)  # filters make as much
    effects = joints + len(root_turns)
    if not sample.effects or not sample.count:
        return np.zeros(effects), np.zeros_like(fit.covariance)
    across, inner, right = zip(*(sample.effects[gait] for gait in sorted(sample.effects)), strict=True)
    torques = np.arange(len(right) * len(right[0])) % effects < joints
    cross = fit.pulled(np.hstack(across))  # for all coordinates
    gradient = np.hstack([fit.values @ columns for columns in across]) - np.concatenate(right)
    free = np.flatnonzero(~fit.at_bound.ravel() & fit.laws.free.ravel())  # friction, which explains what it can of them
    blocks, f = fit.laws.jacobians(fit.internal), sample.friction
    hessian = times_blocks(times_blocks(sample.information[:f, :f], blocks).T, blocks)[np.ix_(free, free)]
    hessian += np.diag(fit.laws.prior[1].ravel()[free] ** -2.0)
    explained = np.linalg.solve(hessian, cross[free][:, torques]).T
    slope = sample.information @ fit.values - sample.right
    mean, deviation = fit.laws.prior
    pull = fit.pulled(slope[:, None])[:friction, 0] + ((fit.internal - mean) / deviation**2).ravel()
    information = scipy.linalg.block_diag(*inner)[np.ix_(torques, torques)] - explained @ cross[free][:, torques]
    variance = reml_variances(information, explained @ pull[free] - gradient[torques], joints)
    effect_std = np.clip(np.sqrt(variance), least, np.maximum(largest, least))
    effect_std = np.concatenate([effect_std, ROOT_EFFECT_FACTOR * root_turns])
    bias = fit.covariance @ cross * (count / sample.count) * np.resize(effect_std, len(torques))
    return effect_std, bias @ bias.T


def reml_variances(information: Array, gradient: Array, joints: int) -> Array:
    """Estimate the variances of random effects z, one per joint, shape (n,): equations (30) and (31).

    Their score g has the covariance M + M Q M. Fisher's scoring of its likelihood (REML) solves, with
    N = (I + M Q)^-1 M, t = (I + M Q)^-1 g, and sums over the effects k, l of joints i and j,

        sum_j (sum N_kl^2) (Q'_j - Q_j) = sum (t_k^2 - N_kk)

    A few steps determine one joint's variance poorly: variances of joints that differ only by chance are pooled. No
    variance is negative.

    Parameters
    ----------
    information, gradient
        M, shape (c, c), and g, shape (c,); the joint of an effect is its index modulo n.
    joints
        Number n.
    """
    variance = np.zeros(joints)
    for _ in range(5):
        squares, score = _scoring(information, gradient, variance)
        unit = 1 / np.sqrt(np.maximum(np.diag(squares), 1e-300))
        values, vectors = np.linalg.eigh(squares * np.outer(unit, unit))
        factor = vectors * np.sqrt(np.maximum(values, 1e-9))  # few steps leave it singular
        aim = (unit * score @ vectors) / np.sqrt(np.maximum(values, 1e-9))
        variance = unit * scipy.optimize.nnls(factor.T, aim + factor.T @ (variance / unit))[0]
    chance = 2 * np.diag(_inverse(_scoring(information, gradient, np.zeros(joints))[0]))  # if all were zero
    squares, score = _scoring(information, gradient, variance)
    return np.maximum(partly_pooled(variance + _inverse(squares) @ score, chance), 0.0)


def _scoring(information: Array, gradient: Array, variance: Array) -> tuple[Array, Array]:
    """Compute the sums of squares of N, shape (n, n), and the score of each joint's variance, shape (n,)."""
    joints, size = len(variance), len(gradient)
    mixed = np.eye(size) + information * np.tile(variance, size // joints)
    weighed = np.linalg.solve(mixed, np.column_stack([information, gradient]))
    inner, score = weighed[:, :-1], weighed[:, -1] ** 2 - np.diag(weighed)
    squares = (inner**2).reshape(-1, joints, size // joints, joints).sum(axis=(0, 2))
    return squares, score.reshape(-1, joints).sum(axis=0)


def _inverse(squares: Array) -> Array:
    """Invert the squares, shape (n, n), with nearly infinite variance for joints without information."""
    return inverse_of(squares + 1e-9 * np.diag(np.diag(squares) + 1e-12 * np.trace(squares) + 1e-100))


def partly_pooled(values: Array, variances: Array) -> Array:
    """Shrink estimates, shape (n,), towards their mean according to their variances: equation (32).

    The less they differ beyond chance, the more they shrink, up to the mean (DerSimonian and Laird 1986).
    """
    weight = 1 / variances
    mean = weight @ values / weight.sum()
    excess = weight @ (values - mean) ** 2 - (len(values) - 1)
    between = max(excess, 0.0) / max(weight.sum() - weight @ weight / weight.sum(), 1e-300)
    return np.asarray(mean + between / (between + variances) * (values - mean))
