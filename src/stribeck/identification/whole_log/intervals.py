"""What the whole log says about each joint, in the form that verdicts are made from."""

from __future__ import annotations

import numpy as np

from stribeck.identification.covariance import intervals_95
from stribeck.identification.descent import to_external
from stribeck.identification.joint_fit import AT_BOUND, JointFit
from stribeck.identification.whole_log.estimate import WholeLogFit


def joint_fits(fit: WholeLogFit, names: tuple[str, ...]) -> dict[str, JointFit]:
    """Return the fits of all joints by name.

    The covariance is the inverse curvature of all coordinates together, so that what is not known of the model widens
    the friction's intervals; it is scaled by chi^2 where the errors are larger than they were taken to be.
    """
    curves, solution = fit.curves, fit.solution
    law, logs = curves.law, curves.logarithmic
    count = len(law.parameters)
    scale = max(1.0, fit.chi_square)
    bounds = np.array([(parameter.lower, parameter.upper) for parameter in law.parameters])
    freedom = np.full(count, max(fit.stretches - 1.0, 1.0))
    fits = {}
    for k, name in enumerate(names):
        own = slice(k * count, (k + 1) * count)
        covariance = scale * solution.covariance[own, own]
        deviation = np.sqrt(np.diag(covariance))
        share = fit.true_share[k]
        values = to_external(solution.internal[k], logs) * share
        deviation, covariance = deviation * share, covariance * np.outer(share, share)
        factor = np.where(logs, values, 1.0)
        distance = np.min(np.abs(solution.internal[k] - curves.bounds), axis=0)
        fits[name] = JointFit(
            parameters=law.parameters,
            values=values,
            standard_errors=deviation * factor,
            covariance=covariance * np.outer(factor, factor),
            intervals=np.clip(intervals_95(values, deviation, freedom, logs), bounds[:, :1], bounds[:, 1:]),
            degrees_of_freedom=freedom,
            at_bound=solution.held[k] | (distance < AT_BOUND * deviation),
            rms=float(fit.residual_rms[k]),
            samples=fit.statistic.count // len(names),
            blocks=fit.stretches,
            starts=2,
            cost=solution.cost,
            settled=solution.settled,
        )
    return fits
