"""Windows with outliers: pushes, impacts, bumps (docs/estimator-fit.md, "Outliers").

Residuals standardized by a robust scale: Rousseeuw and Leroy 1987.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.whole_log.constants import OUTLIER, PILOT_OUTLIER, SHOULDER
from stribeck.whole_log.noise.likelihood import Groups
from stribeck.whole_log.noise.variance_components import VarianceComponents
from stribeck.whole_log.weak_equations import WeakEquations

INCONSISTENT = 20.0
"""Chi^2 per equation relative to consistent segments, from which a segment is rejected [1]; undisturbed ones reach
17."""


@dataclass(frozen=True, eq=False)
class Prediction:
    """Prediction of all segments by the pilot, with its uncertainty.

    Attributes
    ----------
    values, covariance
        Coefficients, then corrections, shape (D,), with their covariance, shape (D, D).
    components
        Variance components of the errors.
    """

    values: Array
    covariance: Array
    components: VarianceComponents

    def set_aside(self, part: WeakEquations, rows: Array) -> WeakEquations:
        """Reject windows that are too far from their prediction.

        `rows` are the derivatives of the equations by all values in the first columns, left sides in the last.
        """
        own = rows[:, : len(self.values)]
        variance = self.components.marginal(part)
        size = np.abs(rows[:, -1] - own @ self.values).reshape(variance.shape)
        if not (size > OUTLIER * np.sqrt(variance)).any():
            return part
        far = size > SHOULDER * np.sqrt(variance)  # the others are not, with a larger variance
        near = own[far.ravel()]
        variance[far] += np.sum((near @ self.covariance) * near, axis=1)
        outlying = outlying_windows(size / np.sqrt(variance), OUTLIER)
        if not outlying.any():
            return part
        reach = np.ones(2 * part.lags + 1)  # windows that share errors with it go too
        return replace(part, set_aside=np.convolve(outlying, reach)[part.lags : -part.lags] > 0)

    def explains(self, product: Array, count: int) -> bool:
        """Check whether the prediction explains a segment, from the product of its whitened rows and their number.

        The rows come from `set_aside`. A disturbance of all windows, each below an outlier, shows in their sum.
        """
        information, right = product[: len(self.values), : len(self.values)], product[: len(self.values), -1]
        square = float(product[-1, -1] + self.values @ (information @ self.values - 2 * right))
        return square < INCONSISTENT * (count + float(np.sum(information * self.covariance)))


def without_outliers(parts: Sequence[tuple[Groups, Array]], components: VarianceComponents) -> list[Groups]:
    """Remove windows whose residuals are far larger than most residuals of the same equation.

    `residuals` of a fit to the groups have shape (g, b). The scale of an equation is its median over valid windows on
    the same feet, divided by the median of a normal distribution, but at least the components' expectation.
    """
    sizes, modes, used = [], [], []
    for groups, left in parts:
        deviation = np.sqrt(groups.of_windows(components.marginal(groups.part)))
        sizes.append((np.abs(left).reshape(deviation.shape) / deviation).reshape(-1, deviation.shape[2]))
        modes.append((groups.part.standing.tobytes(), deviation.shape[2]))
        used.append(sizes[-1][groups.of_windows(groups.part.used).ravel()])
    found = []
    for (groups, _), size, mode in zip(parts, sizes, modes, strict=True):
        same_mode = np.concatenate([other for other, own in zip(used, modes, strict=True) if own == mode])
        if not groups.part.used.any():  # a disturbed whole segment must not come back and spoil the scale
            found.append(groups)
            continue
        scale = np.median(same_mode, axis=0) / 0.6745 if len(same_mode) else np.ones(size.shape[1])
        outlying = outlying_windows(size / np.maximum(scale, 1.0), PILOT_OUTLIER)
        aside = np.zeros(len(groups.part.time), dtype=bool)
        places = groups.of_windows(np.arange(len(aside))).ravel()
        aside[places] = outlying
        found.append(replace(groups, part=replace(groups.part, set_aside=aside if outlying.any() else None)))
    return found


def outlying_windows(sizes: Array, outlier: float) -> NDArray[np.bool_]:
    """Find windows whose standardized residual, shape (K, m), is above `outlier`, shape (K,).

    An outlier lasts as long as residuals stay above `SHOULDER`.
    """
    largest = sizes.max(axis=1, initial=0.0)
    numbers = np.cumsum(np.diff(largest > SHOULDER, prepend=False))  # of runs above it, and below
    return np.asarray(np.isin(numbers, numbers[largest > outlier]))
