"""Windows that outliers are in: pushes, blows, bumps (docs/estimator.md, "Outliers").

Standardised residuals against a robust scale: Rousseeuw and Leroy 1987.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import label

from stribeck.base.typing import Array
from stribeck.whole_log.constants import OUTLIER, PILOT_OUTLIER, SHOULDER
from stribeck.whole_log.model.parametrisation import Parametrisation
from stribeck.whole_log.noise.variance_components import VarianceComponents
from stribeck.whole_log.weak_equations import WeakEquations

MEDIAN_OF_SIZE = 0.6745
"""Median absolute value of a normal distribution of variance one [1]."""


@dataclass(frozen=True, eq=False)
class Prediction:
    """What a fit to some segments says of others, and how sure it is.

    Attributes
    ----------
    parameters, x, covariance
        The fit's values, shape (m,), with their covariance, shape (m, m).
    components
        Of the errors.
    """

    parameters: Parametrisation
    x: Array
    covariance: Array
    components: VarianceComponents

    def set_aside(self, equations: WeakEquations, rows: Array) -> WeakEquations:
        """Return equations with the windows set aside that are too far from their prediction.

        Parameters
        ----------
        rows
            Derivatives of the equations by all values in the first columns, left sides in the last, (K m, D or more).
        """
        values = self.parameters.values(self.x)
        derivatives = rows[:, : len(values)]
        variance = self.components.marginal(equations)
        size = np.abs(rows[:, -1] - derivatives @ values).reshape(variance.shape)
        far = np.flatnonzero((size > SHOULDER * np.sqrt(variance)).any(axis=1))
        if not (size > OUTLIER * np.sqrt(variance)).any():
            return equations
        own = derivatives.reshape(*variance.shape, -1)[far].reshape(-1, len(values))
        slope = self.parameters.times_jacobian(own, self.parameters.blocks(self.x))
        variance[far] += np.sum((slope @ self.covariance) * slope, axis=1).reshape(-1, variance.shape[1])
        return without(equations, size / np.sqrt(variance), OUTLIER)


def far_from_most(parts: Sequence[tuple[WeakEquations, Array]], components: VarianceComponents) -> list[WeakEquations]:
    """Return equations with the windows set aside whose residuals are far larger than most of the same equation.

    Given are the residuals of a fit to them, shape (K m,). The scale of an equation is its median over all windows on
    the same feet: outliers do not move it.
    """
    sizes = [
        np.abs(residual.reshape(part.residual.shape)) / np.sqrt(components.marginal(part)) for part, residual in parts
    ]
    modes = [(part.standing.tobytes(), part.residual.shape[1]) for part, _ in parts]
    found = []
    for (part, _), size, mode in zip(parts, sizes, modes, strict=True):
        same_mode = np.concatenate([other for other, own in zip(sizes, modes, strict=True) if own == mode])
        scale = np.median(same_mode, axis=0) / MEDIAN_OF_SIZE
        found.append(without(replace(part, set_aside=None), size / scale, PILOT_OUTLIER))
    return found


def without(equations: WeakEquations, sizes: Array, outlier: float) -> WeakEquations:
    """Return equations with outliers set aside: windows whose standardised residual, shape (K, m), is above `outlier`.

    An outlier lasts as long as residuals stay above `SHOULDER`; windows that share errors with it go too.
    """
    largest = sizes.max(axis=1)
    if largest.max() <= outlier:
        return equations
    numbers = label(largest > SHOULDER)[0]
    outlying = np.isin(numbers, numbers[largest > outlier])
    reach = np.ones(2 * equations.lags + 1)
    return replace(equations, set_aside=np.convolve(outlying, reach)[equations.lags : -equations.lags] > 0)
