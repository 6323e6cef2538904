"""Windows with outliers, and segments that contradict: pushes, impacts, slip (docs/estimator-fit.md, "Outliers").

Residuals standardized by a robust scale: Rousseeuw and Leroy 1987.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.equations.constants import OUTLIER, PILOT_OUTLIER, PILOT_OUTLIER_OF_MEANS, SHOULDER
from stribeck.core.equations.weak_equations import WeakEquations
from stribeck.core.estimator.noise.likelihood import Groups
from stribeck.core.estimator.noise.variance_components import VarianceComponents, means
from stribeck.core.estimator.solver.positive_definite import inverse_of, solution_of

CONTRADICTS = 10.0
"""Chi^2 per equation relative to usual segments, from which a segment contradicts the pilot [1]: at most 8 for
undisturbed segments, 12 to 250 where a foot of a quadruped touches the ground unnoticed, or slips."""


@dataclass(frozen=True, eq=False)
class Prediction:
    """Prediction of all segments by the pilot, with its uncertainty.

    Attributes
    ----------
    values, covariance
        Coefficients, then corrections, shape (D,), with their covariance, shape (D, D).
    components
        Variance components of the errors.
    usual
        Median chi^2 per equation of the pilot's segments [1].
    """

    values: Array
    covariance: Array
    components: VarianceComponents
    usual: float

    def set_aside(self, part: WeakEquations, rows: Array) -> WeakEquations:
        """Reject windows that are too far from their prediction.

        `rows` are the derivatives of the equations by all values in the first columns, left sides in the last.
        """
        shape = part.residual.shape
        slopes = rows[:, : len(self.values)].reshape(*shape, -1)
        residual = rows[:, -1].reshape(shape) - slopes @ self.values
        for limit in (OUTLIER, SHOULDER):  # most segments have no outlier
            sizes = self._standardized(part, slopes, residual, 1, limit)
            of_means = self._standardized(part, slopes, residual, part.lags + 1, limit)  # show hidden pushes
            for k in range(part.lags + 1):
                those = sizes[k : k + len(of_means)]
                np.maximum(those, of_means, out=those)
            outlying = outlying_windows(sizes, OUTLIER)
            if not outlying.any():
                return part
        reach = np.ones(2 * part.lags + 1)  # windows that share errors with it go too
        return replace(part, set_aside=np.convolve(outlying, reach)[part.lags : -part.lags] > 0)

    def contradicts(self, information: Array, right: Array, square: float, count: int) -> bool:
        """Check that a segment of `count` equations contradicts the pilot, by sums over its whitened equations.

        These are X^T X, shape (D, D), X^T y, shape (D,), and y^T y. With the residual r at the predicted values and
        their covariance C, r^T (I + X C X^T)^-1 r is chi^2 after the segment has corrected the values, including the
        cost of this change.
        """
        limit, gap = CONTRADICTS * self.usual * count, right - information @ self.values
        size = square - float(self.values @ (right + gap))
        if size <= limit:
            return False
        free, precision = self._free
        change = solution_of(precision + information[np.ix_(free, free)], gap[free])
        return size - float(gap[free] @ change) > limit

    @cached_property
    def _free(self) -> tuple[IntArray, Array]:
        """Places of the values that are not held, shape (k,), and the inverse of their covariance, shape (k, k)."""
        free = np.flatnonzero(np.diag(self.covariance))
        return free, inverse_of(self.covariance[np.ix_(free, free)])

    def _standardized(self, part: WeakEquations, slopes: Array, residual: Array, windows: int, limit: float) -> Array:
        """Standardize means of the residuals of consecutive windows; the prediction's error counts above a limit."""
        size, variance = np.abs(means(residual, windows)), self.components.marginal(part, windows)
        far = size > limit * np.sqrt(variance)  # the others are not, with a larger variance
        if (size > OUTLIER * np.sqrt(variance)).any():
            places, rows = np.nonzero(far)
            near = sum(slopes[places + k, rows] for k in range(windows)) / windows
            variance[far] += np.sum((near @ self.covariance) * near, axis=1)
        return np.asarray(size / np.sqrt(variance))


def without_outliers(
    parts: Sequence[Groups], residuals: Sequence[Array], components: VarianceComponents
) -> list[Groups]:
    """Remove windows whose residuals are far larger than most residuals of the same equation.

    `residuals` of a fit to the groups have shape (g, b). The scale of an equation is its median over valid windows on
    the same feet, divided by the median of a normal distribution, but at least the components' expectation.
    """
    scaled = [_scaled(parts, residuals, components, mean=mean) for mean in (False, True)]
    result = []
    for groups, of_windows, of_means in zip(parts, *scaled, strict=True):
        if not groups.part.used.any():  # a disturbed whole segment must not come back and spoil the scale
            result.append(groups)
            continue
        outlying = outlying_windows(of_windows, PILOT_OUTLIER) | outlying_windows(of_means, PILOT_OUTLIER_OF_MEANS)
        aside = np.zeros(len(groups.part.time), dtype=bool)
        places = groups.of_windows(np.arange(len(aside))).ravel()
        aside[places] = outlying
        result.append(replace(groups, part=replace(groups.part, set_aside=aside if outlying.any() else None)))
    return result


def _scaled(
    parts: Sequence[Groups], residuals: Sequence[Array], components: VarianceComponents, *, mean: bool
) -> list[Array]:
    """Standardize the residuals of windows, or their means over each group, by a robust scale, shape (g lags, m)."""
    sizes, modes, used = [], [], []
    for groups, residual in zip(parts, residuals, strict=True):
        part, lags = groups.part, groups.part.lags
        size = np.abs(residual.reshape(groups.of_windows(part.residual).shape))
        deviation = np.sqrt(groups.of_windows(components.marginal(part)))
        if mean:
            size = np.abs(residual.reshape(size.shape).mean(axis=1, keepdims=True)).repeat(lags, axis=1)
            deviation = np.sqrt(components.marginal(part, lags)[::lags][groups.places])[:, None]
        sizes.append((size / deviation).reshape(-1, size.shape[2]))
        modes.append((part.standing.tobytes(), size.shape[2]))
        used.append(sizes[-1][groups.of_windows(part.used).ravel()])
    scaled = []
    for size, mode in zip(sizes, modes, strict=True):
        same_mode = np.concatenate([other for other, other_mode in zip(used, modes, strict=True) if other_mode == mode])
        scale = np.median(same_mode, axis=0) / 0.6745 if len(same_mode) else np.ones(size.shape[1])
        scaled.append(size / np.maximum(scale, 1.0))
    return scaled


def outlying_windows(sizes: Array, outlier: float) -> NDArray[np.bool_]:
    """Find windows whose standardized residual, shape (K, m), is above `outlier`, shape (K,).

    An outlier lasts as long as residuals stay above `SHOULDER`.
    """
    largest = sizes.max(axis=1, initial=0.0)
    numbers = np.cumsum(np.diff(largest > SHOULDER, prepend=False))  # of runs above it, and below
    return np.asarray(np.isin(numbers, numbers[largest > outlier]))
