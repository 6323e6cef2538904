"""Fit friction and bodies to rows of the equation of motion: weights, solution, covariance (docs/other-methods.md)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.judgement.speed import robust_scale
from stribeck.core.robot.inertial_parameters import SIZE
from stribeck.paper.curve_fit.covariance import Uncertainty, inverses, jackknife
from stribeck.paper.curve_fit.robust import TUNING
from stribeck.paper.direct.consistent import base_parameters, minimise
from stribeck.paper.direct.rows import ROOT, DirectRows, Weights

Regression = Literal["ordinary", "weighted", "robust"]


@dataclass(frozen=True, eq=False, kw_only=True)
class DirectFit:
    """Least squares estimate of L bodies and q friction coefficients.

    Attributes
    ----------
    change
        Difference of the inertial parameters from the model's, shape (L, 10).
    coefficients, held
        Friction coefficients, and mask of those at zero, shape (q,).
    covariance, freedom
        Covariance of change and coefficients, shape (10 L + q,) * 2, and degrees of freedom, shape (10 L + q,).
    known
        Share of each body's prior variance that the log removes [1], shape (L,).
    deviation
        Standard deviations of each kind of row [N m], shape (kinds,).
    overdispersion
        Variance of the blocks' scores divided by the variance for independent samples [1].
    base_columns, condition
        Indices of the base parameters of the motion, shape (b,), and condition number of their columns [1].
    converged
        Whether weights and overdispersion have converged.
    """

    change: Array
    coefficients: Array
    held: BoolArray
    covariance: Array
    freedom: Array
    known: Array
    deviation: Array
    overdispersion: float
    base_columns: IntArray
    condition: float
    converged: bool


def fit_direct(
    rows: Sequence[DirectRows],
    nominal: Array,
    weight: float,
    prior_std: Array,
    bounded: BoolArray,
    regression: Regression,
) -> DirectFit:
    """Fit bodies and friction together.

    Parameters
    ----------
    rows
        Rows of all logs.
    nominal
        Inertial parameters of the model's physically possible bodies, shape (L, 10).
    weight
        Weight of the divergence from `nominal`, for errors of unit variance.
    prior_std, bounded
        Wide prior standard deviations of the friction coefficients, and mask of those with a lower bound of zero, shape
        (q,).
    regression
        Weighting of rows.
    """
    size = nominal.size
    least = _torques(rows, regression)
    spread = Spread(least, np.full(ROOT, 0.0 if regression == "ordinary" else 1.0))  # [m/s^2], [rad/s^2]
    overdispersion, converged = 1.0, False
    for _ in range(30):
        weighted = spread.weights(rows)
        total, right = _normal_equations(weighted)
        solution = minimise(total / overdispersion, right / overdispersion, nominal, weight, prior_std**-2, bounded)
        x, penalty = np.append((solution.parameters - nominal).ravel(), solution.coefficients), solution.hessian
        before = np.append(spread.logarithms, np.log(overdispersion))
        free = np.append(np.ones(size, dtype=bool), ~solution.held)
        overdispersion = _design_effect(total, overdispersion * penalty, _scores(weighted, x), free)
        plain = replace(spread, ratios=()).weights(rows) if spread.ratios else weighted
        # below 1e-4 of the torque, rounding would determine parameters that are not excited
        now = _spread(plain, x, spread, regression, 1e-4 * least)
        if np.abs(np.append(now.logarithms, np.log(overdispersion)) - before).max() < 0.03:
            converged = True
            break
        spread = now
    inverse = np.linalg.inv(np.linalg.cholesky(penalty))
    estimate = _two_way(
        [inverse @ matrix @ inverse.T / overdispersion for matrix in _information(weighted)],
        [scores @ inverse.T / overdispersion for scores in _scores(weighted, x)],
    )
    of_bodies = np.minimum(np.diag(estimate.covariance)[:size], 1.0).reshape(-1, SIZE)
    columns, condition = base_parameters(_structure(weighted, size))
    return DirectFit(
        change=solution.parameters - nominal,
        coefficients=solution.coefficients,
        held=solution.held,
        covariance=inverse.T @ estimate.covariance @ inverse,
        freedom=estimate.degrees_of_freedom,
        known=1 - of_bodies.mean(axis=1),
        deviation=spread.deviation,
        overdispersion=overdispersion,
        base_columns=columns,
        condition=condition,
        converged=converged,
    )


def _two_way(information: Sequence[Array], scores: Sequence[Array]) -> Uncertainty:
    """Compute the covariance for errors correlated within two kinds of clusters (Cameron, Gelbach, Miller 2011).

    It is the sum of both covariances, with the prior's share counted once, in units of the prior.
    """
    by_block, *more = (jackknife(*pair) for pair in zip(information, scores, strict=True) if len(pair[0]) > 1)
    if not more:
        return by_block
    # same rounding as in the covariance, to avoid a negative difference
    inverse = inverses((information[0].sum(axis=0) + np.eye(len(by_block.covariance)))[None])[0]
    return Uncertainty(
        by_block.covariance + more[0].covariance - inverse @ inverse,
        np.minimum(by_block.degrees_of_freedom, more[0].degrees_of_freedom),
    )


def _torques(rows: Sequence[DirectRows], regression: Regression) -> Array:
    """Compute the root mean square of the left side per kind of row, or of all together [N m], shape (kinds,).

    Values are bounded below relative to the largest; all are one if all are zero.
    """
    kinds = 1 + max(int(part.kind.max()) for part in rows)
    squares, count = np.zeros((2, kinds))
    for part in rows:
        np.add.at(squares, part.kind, np.sum(part.left**2 * part.used, axis=0))
        np.add.at(count, part.kind, part.used.sum(axis=0))
    if regression == "ordinary":
        squares, count = np.full(kinds, squares.sum()), np.full(kinds, count.sum())
    torques = np.sqrt(squares / np.maximum(count, 1))
    return np.maximum(torques, 1e-6 * (float(torques.max()) or 1.0))


@dataclass(frozen=True, eq=False)
class Spread:
    """Scatter of the rows.

    Attributes
    ----------
    deviation
        Standard deviations of each kind of row [N m], shape (kinds,).
    root_std
        Standard deviations of the root's acceleration, shape (6,).
    ratios
        Residuals divided by their deviations for each part, shape (K, m), if large ones are downweighted.
    """

    deviation: Array
    root_std: Array
    ratios: tuple[Array, ...] = ()

    @property
    def logarithms(self) -> Array:
        """Vector of all standard deviations."""
        root_std = np.maximum(self.root_std, 1e-3)  # smaller values are rounding
        return np.asarray(np.log(np.append(self.deviation, root_std)))

    def weights(self, rows: Sequence[DirectRows]) -> list[tuple[DirectRows, Weights]]:
        """Compute the weights of the rows."""
        weighted = []
        for k, part in enumerate(rows):
            scale = part.used / self.deviation[part.kind]
            if self.ratios:
                scale = scale / np.sqrt(np.maximum(np.abs(self.ratios[k]) / TUNING["huber"], 1.0))
            weighted.append((part, part.weights(scale, self.root_std)))
        return weighted


Weighted = Sequence[tuple[DirectRows, Weights]]


def _normal_equations(weighted: Weighted) -> tuple[Array, Array]:
    """Compute information, shape (p, p), and right-hand side, shape (p,)."""
    size = weighted[0][0].columns.shape[2]
    information, right = np.zeros((size, size)), np.zeros(size)
    for part, weights in weighted:
        columns = part.columns.reshape(-1, size)
        information += columns.T @ weights.apply(part.columns).reshape(-1, size)
        right += columns.T @ weights.apply(part.left[:, :, None]).ravel()
    return information, right


def _information(weighted: Weighted) -> list[Array]:
    """Compute the information of each cluster, shape (B, p, p), for both kinds."""
    size = weighted[0][0].columns.shape[2]
    sums = [np.zeros((count, size, size)) for count in _counts(weighted)]
    for part, weights in weighted:
        columns = weights.apply(part.columns)
        for information, cluster in zip(sums, part.clusters, strict=True):
            for number in np.unique(cluster[cluster >= 0]):
                mask = cluster == number
                information[number] += part.columns[mask].reshape(-1, size).T @ columns[mask].reshape(-1, size)
    return sums


def _scores(weighted: Weighted, x: Array) -> list[Array]:
    """Compute the scores of each cluster at a solution, shape (B, p), for both kinds."""
    sums = [np.zeros((count, len(x))) for count in _counts(weighted)]
    for part, weights in weighted:
        residual = weights.apply((part.left - part.columns @ x)[:, :, None])
        of_samples = (residual.transpose(0, 2, 1) @ part.columns)[:, 0]
        for scores, cluster in zip(sums, part.clusters, strict=True):
            np.add.at(scores, cluster[cluster >= 0], of_samples[cluster >= 0])
    return sums


def _counts(weighted: Weighted) -> list[int]:
    """Count the clusters of both kinds."""
    return [1 + max(int(part.clusters[kind].max()) for part, _ in weighted) for kind in range(2)]


def _spread(weighted: Weighted, x: Array, before: Spread, regression: Regression, least: Array) -> Spread:
    """Estimate the scatter of the rows about a solution, with a lower bound [N m], shape (kinds,)."""
    ratios = []
    squares, count = np.zeros((2, len(before.deviation)))
    sizes: list[list[Array]] = [[] for _ in before.deviation]
    of_root: list[Array] = []
    for part, weights in weighted:
        residual, variance, effects = weights.residuals(part.left - part.columns @ x)
        np.add.at(squares, part.kind, np.sum((residual**2 + variance) * part.used, axis=0))
        np.add.at(count, part.kind, part.used.sum(axis=0))
        ratio = residual / np.sqrt(np.maximum(1 - variance, 1e-3))  # contact forces remove nearly all information below
        for column, kind in enumerate(part.kind):
            sizes[kind].append(ratio[part.used[:, column], column])
        ratios.append(ratio)
        of_root.append(effects[:, :ROOT])
    if regression == "ordinary":
        squares, count = np.full_like(squares, squares.sum()), np.full_like(count, count.sum())
    if regression == "robust":
        factor = np.array([robust_scale(np.concatenate(size)) if size else 1.0 for size in sizes])
    else:
        factor = np.sqrt(np.divide(squares, count, out=np.ones_like(squares), where=count > 0))
    if regression != "ordinary" and of_root[0].size:
        relaxation = 1.8  # exponent of expectation maximization; below 2 converges (Salakhutdinov and Roweis 2003)
        factor **= relaxation
        root_std = before.root_std * np.concatenate(of_root).mean(axis=0) ** (0.5 * relaxation)
    else:
        root_std = before.root_std
    deviation = np.maximum(factor * before.deviation, least)
    return Spread(deviation, root_std, tuple(ratios) if regression == "robust" else ())


def _design_effect(information: Array, penalty: Array, scores: Sequence[Array], free: BoolArray) -> float:
    """Compute the mean design effect tr(T^-1 sum g g^T) / tr(T^-1 A), at least 1 (Rao and Scott 1981).

    The scores g belong to clusters of two kinds; the larger effect is used.
    """
    kept = np.flatnonzero(free)
    block = np.ix_(kept, kept)
    scale = 1 / np.sqrt(np.diag(information + penalty)[kept])
    inverse = np.linalg.inv((information + penalty)[block] * np.outer(scale, scale)) * np.outer(scale, scale)
    expected = float(np.sum(inverse * information[block]))
    return max(1.0, *(float(np.sum((score[:, kept] @ inverse) * score[:, kept])) / expected for score in scores))


def _structure(weighted: Weighted, size: int) -> Array:
    """Select evenly spaced, weighted rows of the regressor, shape (N, 10 L)."""
    step = max(1, sum(part.used.size for part, _ in weighted) // 4000)
    return np.concatenate([w.apply(part.columns[:, :, :size])[::step].reshape(-1, size) for part, w in weighted])
