"""Friction as a whole: the resisting torque at slow, middle and top speed, with its interval."""

import numpy as np
from scipy.special import stdtrit  # of scipy.stats, which is slow to import

from stribeck.base.typing import Array
from stribeck.friction import FrictionLaw, unit_for
from stribeck.friction.parameters import COULOMB
from stribeck.judgement.joint_fit import JointFit
from stribeck.judgement.speed import top_speed
from stribeck.result import CurvePoint, law_slopes

SPEEDS = {"slow": 0.1, "middle": 0.5, "top": 1.0}
"""Shares of the joint's top speed [1] at which its friction is judged."""

WIDEST = 0.25
"""Half of a 95 % interval over the value [1], from which on a curve or a parameter is weak, with all methods.

So far off a simulated parameter counts as wrong (studies/verdicts.py): what is identified is not, 95 times in 100.
"""

NO_FRICTION = 0.5
"""Friction over the residual's root mean square [1] below which it may be none: it explains a tenth of it at most."""

ROUNDING = 1e-9
"""Friction [N m] that is no more than rounding."""


def friction_curve(fit: JointFit, law: FrictionLaw, velocity: Array, prismatic: bool) -> tuple[CurvePoint, ...]:
    """Return the torque that resists motion [N m], [N], at the `SPEEDS`, given the velocities of the samples.

    It is the mean of both directions, r(v) = (R(v) - R(-v)) / 2, so that an offset, which resists nothing, is left out;
    at the mean load, temperature and time of the log. Its variance is g^T C g, with g the derivatives by the fitted
    parameters and C their joint covariance (delta method): what parameters trade with each other cancels. It holds
    where parameters sit on a bound or are unknown by themselves, as the log shows r(v), not them. The interval is
    Student's, its degrees of freedom those of the parameters in proportion to g^2 var, and ends at zero.
    """
    values = fit.law_values(law, fit.mean_load)
    speeds = top_speed(velocity) * np.array(list(SPEEDS.values()))
    resisting = (law.torque(speeds, values) - law.torque(-speeds, values)) / 2
    gradient = (law.jacobian(speeds, values) - law.jacobian(-speeds, values)) / 2
    gradient = gradient @ law_slopes(law, fit.by_name, fit.mean_load)
    errors = np.sqrt(np.maximum(np.einsum("sp,pq,sq->s", gradient, fit.covariance, gradient), 0.0))
    parts = gradient**2 * np.diag(fit.covariance) + np.finfo(float).tiny
    freedom = parts.sum(axis=1) / (parts / fit.degrees_of_freedom).sum(axis=1)
    return curve_points(speeds, resisting, errors, stdtrit(freedom, 0.975), prismatic)


def curve_points(
    speeds: Array, values: Array, errors: Array, quantile: Array | float, prismatic: bool
) -> tuple[CurvePoint, ...]:
    """Build the points of a friction curve; the interval is a quantile of errors on either side and ends at zero."""
    return tuple(
        CurvePoint(
            velocity=float(speed),
            value=float(value),
            standard_error=float(error),
            interval_95=(max(float(value - half), 0.0), float(value + half)),
            unit=unit_for(COULOMB, prismatic),
        )
        for speed, value, error, half in zip(speeds, values, errors, quantile * errors, strict=True)
    )


def relative_width(curve: tuple[CurvePoint, ...]) -> float:
    """Return half of the 95 % interval over the value [1], each the root mean square over the speeds.

    It is what compensating for the curve may leave of the friction torque.
    """
    widths, values = np.array([(point.half_width, point.value) for point in curve]).T
    with np.errstate(over="ignore"):
        return float(np.linalg.norm(widths) / max(np.linalg.norm(values), np.finfo(float).tiny))


def least_known(curve: tuple[CurvePoint, ...]) -> str:
    """Return the name of the speed whose interval is the widest against its value."""
    widths, values = np.array([(point.half_width, point.value) for point in curve]).T
    with np.errstate(over="ignore"):
        shares = widths / np.maximum(values, np.finfo(float).tiny)
    return list(SPEEDS)[int(np.argmax(shares))]


def is_significant(curve: tuple[CurvePoint, ...]) -> bool:
    """Return whether friction is significant at any of the speeds."""
    return any(point.interval_95[0] > 0 for point in curve)


def upper_bound(curve: tuple[CurvePoint, ...]) -> float:
    """Return the torque that friction stays below at all the speeds [N m]."""
    return max(point.interval_95[1] for point in curve)
