"""The covariance budget: the parts of an interval, by name (docs/estimator-fit.md, "Intervals").

With the inverse curvature C and the coordinates x of the model, the uncertainty of the model adds C_.x C_xx^-1 C_x. to
friction's covariance; the rest is noise. A part M = C_.x P C_x. of it comes from the prior of x with the discounted
precision P; the rest, C - M, from errors of the equations. The discount kappa multiplies M, because the prior's errors
are as large as its deviation. The rest is multiplied by D, and averaged with the covariance V of the folds. Random
effects of the gait phase and the group mean add more.
"""

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.core.equations.whole_log.corrections.calibration import CONSIDERED
from stribeck.core.estimator.solver.fit import Fit
from stribeck.core.estimator.solver.positive_definite import inverse_of
from stribeck.core.estimator.uncertainty.heterogeneity import Heterogeneity


@dataclass(frozen=True, eq=False, kw_only=True)
class CovarianceBudget:
    """Parts of the covariance of all coordinates, shape (m, m) each.

    Attributes
    ----------
    noise
        Noise of sensors, and of the model between windows, for known inertias and calibration.
    model
        Uncertainty of inertias, calibration and offsets of logs.
    heterogeneity
        Differences between folds, in addition to noise and model.
    repeated_errors
        Random effects of the gait phase, equation (29).
    group_mean
        Uncertainty of the means of the group priors.
    command_delay
        Uncertainty of the delays of commands, which were estimated before.
    """

    noise: Array
    model: Array
    heterogeneity: Array
    repeated_errors: Array
    group_mean: Array
    command_delay: Array

    @cached_property
    def total(self) -> Array:
        """Sum of all parts."""
        return np.asarray(sum(getattr(self, field.name) for field in fields(self)))

    def terms(self, rows: NDArray[np.int64], gain: Array) -> dict[str, Array]:
        """Compute all terms for some coordinates by name, shape (k, k) each.

        Parameters
        ----------
        rows
            Places of the coordinates, shape (k,).
        gain
            Standard deviations due to a gain common to all torques, shape (k,).
        """
        terms = {field.name.replace("_", " "): getattr(self, field.name)[np.ix_(rows, rows)] for field in fields(self)}
        terms["heterogeneity over folds"] = terms.pop("heterogeneity")
        return terms | {"common gain": np.outer(gain, gain)}


def covariance_budget(
    fit: Fit, repeated_errors: Array, group_mean: Array, differing: Heterogeneity, share: float
) -> CovarianceBudget:
    """Build the budget of a fit from its covariance, the inverse curvature.

    `differing` is the heterogeneity of a fit to a `share` of the equations [1].
    """
    layout, kept = fit.layout, fit.model.nearly_right
    model = through(fit, np.r_[layout.places("bodies", "wrenches"), layout.places("log_effects")])
    across = fit.covariance[:, layout.places("bodies", "base_delay")]
    prior = across @ fit.model.precision[kept, kept] @ across.T
    rest = fit.covariance - prior
    wider = np.r_[np.repeat(differing.joints, fit.internal.shape[1]), np.full(len(fit.corrections), differing.model)]
    of_folds = np.sqrt(np.outer(wider, wider)) * rest
    if differing.covariance is not None:
        of_folds = (of_folds + share * differing.covariance) / 2
        ratio = np.maximum(np.diag(rest), 0.0) / np.maximum(np.diag(of_folds), 1e-300)
        narrow = np.sqrt(np.maximum(ratio, 1.0))  # folds may agree by chance
        of_folds *= np.outer(narrow, narrow)
    return CovarianceBudget(
        noise=fit.covariance - model,
        model=model + (fit.model.overdispersion - 1) * prior,
        heterogeneity=of_folds - rest,
        repeated_errors=repeated_errors,
        group_mean=group_mean,
        command_delay=through(fit, layout.places("command_delays")) / CONSIDERED**2,
    )


def through(fit: Fit, places: NDArray[np.int64]) -> Array:
    """Compute the share of a fit's covariance due to some coordinates b, C[:, b] C[b, b]^-1 C[b, :]."""
    across = fit.covariance[places]
    return np.asarray(across.T @ (inverse_of(across[:, places]) @ across)) if len(across) else 0 * fit.covariance
