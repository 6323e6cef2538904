"""Why each interval is as wide as it is: the terms of the covariance, by name.

With C the covariance of all coordinates that the curvature of the posterior gives, and b those of the model, what is
not known of the model adds C_fb C_bb^-1 C_bf to friction's covariance; the rest is noise. Errors that every step
repeats, the mean of a group of joints, and a model that parts of the log disagree about add more. All of it grows where
errors are larger than they were taken to be (overdispersion), or where parts of the log disagree about a joint.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from stribeck.identification.whole_log.solver.solve import Solution, inverse_of
from stribeck.typing import Array


@dataclass(frozen=True, eq=False, kw_only=True)
class CovarianceBudget:
    """Terms of the covariance of all coordinates, shape (m, m) each.

    Attributes
    ----------
    noise
        Of sensors, and of the model from window to window, if inertias and calibration were known.
    model
        As these are not known.
    repeated_errors
        That every step has alike.
    group_mean
        As what joints have in common is not known for certain.
    heterogeneity
        As parts of the log disagree about the model.
    """

    noise: Array
    model: Array
    repeated_errors: Array
    group_mean: Array
    heterogeneity: Array

    @property
    def total(self) -> Array:
        """The sum."""
        return np.asarray(sum(getattr(self, field.name) for field in fields(self)))

    def terms(self, own: NDArray[np.int64], overdispersion: float, of_each: Array, gain: Array) -> dict[str, Array]:
        """Return all terms of some coordinates by name, shape (k, k) each.

        Parameters
        ----------
        own
            Places of the coordinates, shape (k,).
        overdispersion, of_each
            What variances are multiplied by as errors are larger than expected, and as parts of the log disagree about
            each coordinate, shape (k,), whichever is more [1].
        gain
            Standard deviations that one gain common to all torques gives, shape (k,).
        """
        block = np.ix_(own, own)
        found = {field.name.replace("_", " "): getattr(self, field.name)[block] for field in fields(self)}
        wider = np.sqrt(np.maximum(overdispersion, of_each))
        added = self.total[block] * (np.outer(wider, wider) - 1)
        differs = np.logical_or.outer(of_each > overdispersion, of_each > overdispersion)
        found["heterogeneity over folds"] = found.pop("heterogeneity") + np.where(differs, added, 0.0)
        return found | {"overdispersion": np.where(differs, 0.0, added), "common gain": np.outer(gain, gain)}


def covariance_budget(
    solution: Solution, overdispersion: float, repeated_errors: Array, group_mean: Array
) -> CovarianceBudget:
    """Return the budget of a solution, whose covariance is that of the curvature; `overdispersion` is the model's."""
    model = through(solution, solution.layout.part("bodies", "wrenches"))
    return CovarianceBudget(
        noise=solution.covariance - model,
        model=model,
        repeated_errors=repeated_errors,
        group_mean=group_mean,
        heterogeneity=(overdispersion - 1) * through(solution, solution.layout.nearly_right),
    )


def through(solution: Solution, own: slice) -> Array:
    """Return the share of a solution's covariance that comes from some coordinates b, C[:, b] C[b, b]^-1 C[b, :]."""
    across = solution.covariance[own]
    return np.asarray(across.T @ (inverse_of(across[:, own]) @ across)) if len(across) else 0 * solution.covariance
