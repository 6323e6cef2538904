"""Spreads of a robot type's friction, and robots outside them (docs/fleet.md)."""

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.stats import t as student_t

from stribeck.core.base.typing import Array
from stribeck.core.result.log_spread import learn_spread
from stribeck.service.fleet.friction import Fleet


def log_variance(fleet: Fleet) -> tuple[Array, Array]:
    """Learn the variance of each log's logarithm of friction about its robot's, from differences of successive logs.

    Returns
    -------
    variance, freedom
        The variance, shape (N, C), and its degrees of freedom, shape (C,).
    """
    squares = (fleet.error / fleet.friction) ** 2
    rows = np.flatnonzero(fleet.robots[1:] == fleet.robots[:-1])
    rows = rows[np.linspace(0, len(rows) - 1, min(len(rows), 4000)).astype(int)]  # more take longer
    differences = fleet.logarithm[rows + 1] - fleet.logarithm[rows]
    errors = np.sqrt(squares[rows + 1] + squares[rows])
    joint = np.unique([channel.joint for channel in fleet.channels], return_inverse=True)[1]
    spread = learn_spread(differences, errors, joint)
    scale, freedom = spread.student()
    return scale**2 + spread.share * squares, freedom


def reml(mean: Array, variance: Array) -> tuple[float, float, float]:
    """Fit mean_i = mu + b_i + error_i, with known variances of the errors, by restricted maximum likelihood.

    Returns
    -------
    mu, standard_error, spread
        The standard deviation of b_i is `spread`; NaN for a single robot.
    """
    if len(mean) < 2:
        return float(mean[0]), float(np.sqrt(variance[0])), float("nan")

    def average(between: float) -> tuple[float, Array]:
        weight = 1 / (variance + between)
        return float(np.sum(weight * mean) / weight.sum()), weight

    def cost(logarithm: float) -> float:
        mu, weight = average(np.exp(logarithm))
        return float(np.sum(weight * (mean - mu) ** 2 - np.log(weight)) + np.log(weight.sum()))

    top = np.log(np.var(mean, ddof=1) + variance.max() + 1e-300) + 2
    between = float(np.exp(minimize_scalar(cost, bounds=(top - 30, top), method="bounded").x))
    mu, weight = average(between)
    return mu, float(weight.sum() ** -0.5), float(np.sqrt(between))


def outliers(values: Array, alpha: float) -> list[int]:
    """Find values that stand out, by the generalized extreme Studentized deviate test (Rosner 1983).

    At most a quarter of the values stand out; fewer than five are not tested.
    """
    rest, order, count = np.arange(len(values)), list[int](), 0
    for k in range(1, len(values) // 4 + 1) if len(values) > 4 else ():
        n = len(rest)
        spread = values[rest].std(ddof=1)
        distance = np.abs(values[rest] - values[rest].mean())
        worst = int(rest[distance.argmax()])
        quantile = float(student_t.ppf(1 - alpha / (2 * n), n - 2))
        limit = (n - 1) * quantile / np.sqrt((n - 2 + quantile**2) * n)
        order.append(worst)
        rest = rest[rest != worst]
        if distance.max() > limit * spread:
            count = k
    return order[:count]
