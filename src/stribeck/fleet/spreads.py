"""Spreads of a robot type's friction, and robots outside them (docs/fleet.md)."""

import numpy as np
from scipy.optimize import minimize, minimize_scalar
from scipy.stats import norm
from scipy.stats import t as student_t

from stribeck.base.typing import Array
from stribeck.fleet.friction import Fleet


def log_variance(fleet: Fleet, channel: int) -> tuple[Array, float]:
    """Compute the relative variance of each log about its robot's friction, omega^2 + phi s^2, shape (N,).

    omega and phi are the most likely ones of the differences of successive logs, which a change touches once; those
    beyond four robust standard deviations are left out, or as improbable ones if few differences estimate these.

    Returns
    -------
    variance, freedom
        The variance, and its degrees of freedom: two for three differences (von Neumann et al. 1941).
    """
    squares = (fleet.error[:, channel] / fleet.friction[:, channel]) ** 2
    difference = np.diff(fleet.logarithm[:, channel])
    own = squares[1:] + squares[:-1]
    valid = (fleet.robots[1:] == fleet.robots[:-1]) & np.isfinite(difference)
    difference, own = difference[valid], own[valid]
    if len(difference):
        of_median = 0.37 * len(difference)  # degrees of freedom of a median absolute deviation (Hampel 1974)
        limit = student_t.isf(norm.sf(4), max(of_median, 1)) * 1.4826
        kept = np.abs(difference) <= limit * np.median(np.abs(difference))
        difference, own = difference[kept], own[kept]
    freedom = 2 / 3 * len(difference)
    if len(difference) < 5:  # too few to tell omega from phi
        return np.maximum(squares, np.sum(difference**2) / max(2 * len(difference), 1)), freedom
    some = np.linspace(0, len(difference) - 1, min(len(difference), 4000)).astype(int)  # more take longer
    difference, own = difference[some], own[some]
    scale = np.mean(difference**2) + 1e-12 * np.mean(own) + 1e-300

    def cost(logarithms: Array) -> float:
        omega, phi = np.exp(logarithms)
        variance = 2 * omega * scale + phi * own
        return float(np.mean(np.log(variance) + difference**2 / variance))

    bounds = [(-14.0, 3.0), (-9.0, 0.0)]
    starts = [np.array([-0.7, -3.0]), np.array([-5.0, -0.1])]
    best = min((minimize(cost, start, bounds=bounds) for start in starts), key=lambda each: each.fun)
    omega, phi = np.exp(best.x)
    return np.asarray(omega * scale + phi * squares), freedom


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
    left, order, count = np.arange(len(values)), list[int](), 0
    for k in range(1, len(values) // 4 + 1) if len(values) > 4 else ():
        n = len(left)
        spread = values[left].std(ddof=1)
        distance = np.abs(values[left] - values[left].mean())
        worst = int(left[distance.argmax()])
        quantile = float(student_t.ppf(1 - alpha / (2 * n), n - 2))
        limit = (n - 1) * quantile / np.sqrt((n - 2 + quantile**2) * n)
        order.append(worst)
        left = left[left != worst]
        if distance.max() > limit * spread:
            count = k
    return order[:count]
