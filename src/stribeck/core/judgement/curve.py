"""Friction curve: the resisting torque at slow, middle and top speed, with its interval."""

import numpy as np
import scipy  # its special is slow to import: loaded at its first use

from stribeck.core.base.typing import Array
from stribeck.core.friction import FrictionLaw, unit_for
from stribeck.core.friction.parameters import COULOMB
from stribeck.core.friction.terms.motion import drift
from stribeck.core.judgement.joint_fit import JointFit
from stribeck.core.judgement.speed import top_speed
from stribeck.core.result import CurvePoint, law_slopes

SPEEDS = {"slow": 0.1, "middle": 0.5, "top": 1.0}
"""Shares of the joint's top speed [1] at which its friction is judged."""

WIDEST = 0.25
"""Largest half-width of a 95 % interval relative to the value [1]; wider curves and parameters are weak.

In simulations, 95 % of the identified parameters are within this distance of the truth (studies/verdicts.py).
"""

ROUNDING = 1e-9
"""Friction due to rounding errors [N m]."""


def friction_curve(
    fit: JointFit, law: FrictionLaw, velocity: Array, prismatic: bool, torque_unit: str = ""
) -> tuple[CurvePoint, ...]:
    """Compute the torque that resists motion [N m], [N], at the `SPEEDS`, given the velocities of the samples.

    It is the mean of both directions, r(v) = (R(v) - R(-v)) / 2, which cancels the offset, at the mean load,
    temperature and time of the log. Its variance is g^T C g, with g the derivatives with respect to the parameters and
    C their joint covariance (delta method). Errors that compensate for each other cancel, so the variance is valid even
    if single parameters are unknown or at a bound. The interval is Student's, clipped at zero; its degrees of freedom
    are those of the parameters, weighted by g^2 var. The square of a drift from start to end adds to its square:
    the interval contains the friction in 95 % of the log, also if it settles exponentially within a tenth of the log.
    What another shape of the curve would change adds to it, too.
    """
    values = fit.law_values(law, fit.mean_load)
    speeds = top_speed(velocity) * np.array(list(SPEEDS.values()))
    resisting = law.resisting(speeds, values)
    gradient = (law.jacobian(speeds, values) - law.jacobian(-speeds, values)) / 2
    gradient = gradient @ law_slopes(law, fit.by_name, fit.mean_load)
    errors = np.sqrt(np.maximum(np.einsum("sp,pq,sq->s", gradient, fit.covariance, gradient), 0.0))
    parts = gradient**2 * np.diag(fit.covariance) + np.finfo(float).tiny
    freedom = parts.sum(axis=1) / (parts / fit.degrees_of_freedom).sum(axis=1)
    quantile = scipy.special.stdtrit(freedom, 0.975)
    errors = np.sqrt(errors**2 + fit.law_misfit**2 + (drift(fit.by_name, speeds) / quantile) ** 2)
    return curve_points(speeds, resisting, errors, quantile, prismatic, torque_unit)


def curve_points(
    speeds: Array, values: Array, errors: Array, quantile: Array | float, prismatic: bool, torque_unit: str = ""
) -> tuple[CurvePoint, ...]:
    """Build the points of a friction curve. The interval is ± quantile times error, clipped at zero."""
    ends = np.stack([np.maximum(values - quantile * errors, 0.0), values + quantile * errors], axis=1)
    return tuple(
        CurvePoint(
            velocity=float(speed),
            value=float(value),
            standard_error=float(error),
            interval_95=tuple(interval),
            unit=unit_for(COULOMB, prismatic, torque_unit),
        )
        for speed, value, error, interval in zip(speeds, values, errors, ends.tolist(), strict=True)
    )


def relative_width(curve: tuple[CurvePoint, ...]) -> float:
    """Compute half of the 95 % interval relative to the value [1], each as root mean square over the speeds.

    This is the share of friction that can remain after compensation by the curve.
    """
    widths, values = np.array([(point.half_width, point.value) for point in curve]).T
    with np.errstate(over="ignore"):
        return float(np.linalg.norm(widths) / max(np.linalg.norm(values), np.finfo(float).tiny))


def is_significant(curve: tuple[CurvePoint, ...]) -> bool:
    """Check that friction is significant at any of the speeds."""
    return any(point.interval_95[0] > 0 for point in curve)
