"""Misfit of the law: what a free curve would change (docs/estimator-fit.md, "Intervals").

The friction of a joint is its law plus a deviation Phi delta in the basis of the curves, delta ~ N(0, kappa^2 D). All
parameters of the law, the other joints and the corrections are refitted to every deviation, which leaves the
information S and the gradient g. With the eigenvalues l and vectors U of D^(1/2) S D^(1/2), z = U^T D^(1/2) g and the
dispersion s of the errors, z_i ~ N(0, l_i (s + kappa^2 l_i)). The mean of delta delta^T over all kappa, weighted by
their evidence, remains in the interval (model discrepancy: Kennedy and O'Hagan 2001): a law that describes the log
keeps its interval, and terms that the log neither shows nor excludes widen it. The square of the mean deviation counts
twice: where the law misfits, friction that is no function of velocity is assumed to be as large.
"""

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.estimator.solver.fit import Fit
from stribeck.core.estimator.terms.trials import Trials
from stribeck.core.estimator.uncertainty.resisting import Resisting
from stribeck.core.judgement.curve import SPEEDS

DEVIATIONS = np.array([0.0, 0.02, 0.05, 0.1, 0.2, 0.4])
"""Sizes kappa of the deviation relative to the joint's friction [1]; the law is right (0) in half of the joints."""


def law_misfits(fit: Fit, trials: Trials, covariance: Array) -> Array:
    """Compute the standard error of each joint's resisting torque at the `SPEEDS` due to its law, shape (n, 3) [N m].

    Parameters
    ----------
    fit
        Fit with the joints' laws.
    trials
        Equations of the joints, with all else refitted.
    covariance
        Covariance of the intervals, shape (m, m); its ratio to that of the fit is the dispersion.
    """
    laws, tiny = fit.laws, np.finfo(float).tiny
    theta, jacobians = laws.coefficients(fit.internal), laws.jacobians(fit.internal)
    errors = np.empty((len(theta), len(SPEEDS)))
    for joint, free in enumerate(laws.free & ~fit.at_bound):
        information, resisting = trials.information[joint, 0], Resisting(fit, joint)
        curve = slice(resisting.odd.shape[1])
        of_law = jacobians[joint][:, free]
        along = of_law.T @ information
        fitted = np.linalg.solve(along @ of_law + np.diag(laws.prior[1][joint, free] ** -2.0), along)
        beyond = np.eye(len(information)) - of_law @ fitted  # a deviation with all parameters refitted
        gradient = beyond.T @ (trials.right[joint, 0] - information @ theta[joint])
        size = resisting.size * np.sqrt(laws.basis.variance * len(laws.basis.functions))
        left = size[:, None] * (information @ beyond)[curve, curve] * size
        values, vectors = np.linalg.eigh((left + left.T) / 2)
        values, z = np.maximum(values, max(1e-9 * values[-1], tiny)), vectors.T @ (size * gradient[curve])
        wide, narrow = (resisting.variance(matrix).sum() for matrix in (covariance, fit.covariance))
        dispersion, variance = max(trials.scale, wide / max(narrow, tiny)), DEVIATIONS[:, None] ** 2
        ratio = variance * values / dispersion
        evidence = 0.5 * np.sum(z**2 / (values * dispersion) * ratio / (1 + ratio) - np.log1p(ratio), axis=1)
        weights = np.exp(evidence - evidence.max()) * np.where(DEVIATIONS > 0, 1 / (len(DEVIATIONS) - 1), 1.0)
        shrunk = variance / (1 + ratio)
        pushed = resisting.odd @ beyond[curve, curve] @ (size[:, None] * vectors)
        squares = 2 * (pushed @ (shrunk * z / dispersion).T) ** 2 + pushed**2 @ shrunk.T
        errors[joint] = np.sqrt(squares @ weights / weights.sum())
    return errors
