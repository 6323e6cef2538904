"""The covariance budget: the parts of an interval, by name (docs/estimator-fit.md, "Intervals").

With the inverse curvature C and the coordinates x of the model, the uncertainty of the model adds C_.x C_xx^-1 C_x. to
friction's covariance; the rest is noise. Random effects of the gait phase, the group mean, and the model's
heterogeneity over folds add more. The sum is multiplied by the overdispersion, or by a joint's heterogeneity if it is
larger.
"""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.whole_log.model.corrections import CONSIDERED
from stribeck.whole_log.solver.elimination import Fit, inverse_of


@dataclass(frozen=True, eq=False, kw_only=True)
class CovarianceBudget:
    """Parts of the covariance of all coordinates, shape (m, m) each.

    Attributes
    ----------
    noise
        Noise of sensors, and of the model between windows, for known inertias and calibration.
    model
        Uncertainty of inertias, calibration and offsets of logs.
    repeated_errors
        Random effects of the gait phase, equation (29).
    group_mean
        Uncertainty of the means of the group priors.
    heterogeneity
        Heterogeneity of the model over folds.
    command_delay
        Uncertainty of the delays of commands, which were estimated before.
    """

    noise: Array
    model: Array
    repeated_errors: Array
    group_mean: Array
    heterogeneity: Array
    command_delay: Array

    @property
    def total(self) -> Array:
        """Sum of all parts."""
        return np.asarray(sum(getattr(self, field.name) for field in fields(self)))

    def terms(self, own: NDArray[np.int64], overdispersion: float, of_each: Array, gain: Array) -> dict[str, Array]:
        """Compute all terms for some coordinates by name, shape (k, k) each.

        Parameters
        ----------
        own
            Places of the coordinates, shape (k,).
        overdispersion, of_each
            Factors of variances [1], of which the larger is used: chi^2 per degree of freedom, and the heterogeneity
            of each coordinate, shape (k,).
        gain
            Standard deviations due to a gain common to all torques, shape (k,).
        """
        block = np.ix_(own, own)
        found = {field.name.replace("_", " "): getattr(self, field.name)[block] for field in fields(self)}
        wider = np.sqrt(np.maximum(overdispersion, of_each))
        added = self.total[block] * (np.outer(wider, wider) - 1)
        differs = np.logical_or.outer(of_each > overdispersion, of_each > overdispersion)
        found["heterogeneity over folds"] = found.pop("heterogeneity") + np.where(differs, added, 0.0)
        return found | {"overdispersion": np.where(differs, 0.0, added), "common gain": np.outer(gain, gain)}


def covariance_budget(fit: Fit, repeated_errors: Array, group_mean: Array) -> CovarianceBudget:
    """Build the budget of a fit from its covariance, the inverse curvature."""
    layout = fit.layout
    model = through(fit, np.r_[layout.places("bodies", "wrenches"), layout.places("log_offsets")])
    return CovarianceBudget(
        noise=fit.covariance - model,
        model=model,
        repeated_errors=repeated_errors,
        group_mean=group_mean,
        command_delay=through(fit, layout.places("command_delays")) / CONSIDERED**2,
        heterogeneity=(fit.model.overdispersion - 1) * through(fit, layout.places("bodies", "delays")),
    )


def through(fit: Fit, own: NDArray[np.int64]) -> Array:
    """Compute the share of a fit's covariance due to some coordinates b, C[:, b] C[b, b]^-1 C[b, :]."""
    across = fit.covariance[own]
    return np.asarray(across.T @ (inverse_of(across[:, own]) @ across)) if len(across) else 0 * fit.covariance
