"""Weak parameters: detection and explanation."""

from dataclasses import dataclass

import numpy as np

from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.judgement.curve import WIDEST, is_significant
from stribeck.core.judgement.joint_fit import JointFit
from stribeck.core.judgement.reason import Reason
from stribeck.core.judgement.speed import top_speed
from stribeck.core.result import CurvePoint
from stribeck.core.result.tables import least_known, upper_bound

CLEARED = 2.0
"""Minimum ratio of top speed to Stribeck velocity [1]; 2 % of the Stribeck effect is left at this ratio."""

RISING = 2.0
"""Product of slope and speed [1] at which tanh reaches 96 %; faster samples contain no information about the slope."""


@dataclass(frozen=True, kw_only=True)
class Criteria:
    """Properties of a method that make parameters weak in addition to wide intervals.

    Attributes
    ----------
    assumes_exact_law
        Whether the intervals assume an exact law. If so, Coulomb, viscous and Stribeck parameters are weak unless the
        joint moves clearly faster than its Stribeck velocity.
    shares_shapes
        Whether the shape of a joint's curve can come from the other joints, through a group prior.
    """

    assumes_exact_law: bool = True
    shares_shapes: bool = False


USUAL = Criteria()
"""Criteria for methods that fit each joint individually."""


def is_weak(fit: JointFit, velocity: Array, criteria: Criteria = USUAL, unresolved: float = np.nan) -> BoolArray:
    """Find the weak parameters, shape (p,), given the velocities of the joint's samples [rad/s], shape (N,).

    A parameter is weak if

    - it sits at a bound, or a bound other than zero clips its interval,
    - half of its 95 % interval is wider than `WIDEST` times its value,
    - the intervals assume an exact law, and the joint does not move clearly faster than its Stribeck velocity
      (Coulomb, viscous and Stribeck parameters),
    - it is a shape parameter from the group prior, and the friction that it shapes is not significant,
    - it is the damping of bristles whose travel is shorter than `unresolved`, the travel after a reversal within the
      filter's window [rad], [m]; below a quarter of `unresolved`, the travel is weak, too.
    """
    reference = np.abs(fit.values)
    if {"offset", "coulomb"} <= set(fit.names):
        offset, coulomb = fit.names.index("offset"), fit.names.index("coulomb")
        reference[offset] = max(reference[offset], reference[coulomb])
    low, high = fit.intervals.T
    cut = [
        above >= parameter.upper or (below <= parameter.lower and parameter.lower > 0)
        for parameter, below, above in zip(fit.parameters, low, high, strict=True)
    ]
    weak = np.asarray(fit.at_bound | cut | (high - low > 2 * WIDEST * reference))
    if criteria.assumes_exact_law and not _clears(fit, weak, velocity):
        weak |= np.isin(fit.names, ("viscous", "coulomb", "stribeck_gain"))
    if criteria.shares_shapes:
        weak |= np.isin(fit.names, _shape_of_nothing(fit))
    if "bristle_travel" in fit.names:
        travel, damping = (fit.names.index(name) for name in ("bristle_travel", "bristle_damping"))
        weak[travel] |= not fit.values[travel] >= 0.25 * unresolved  # NaN without reversals
        weak[damping] |= weak[travel] or fit.values[travel] < unresolved
    return weak


def _shape_of_nothing(fit: JointFit) -> list[str]:
    """List the shape parameters of insignificant friction, which only the group prior determines."""
    insignificant = {name for name, low in zip(fit.names, fit.intervals[:, 0], strict=True) if low <= 0}
    jumps = {p.name for p in fit.parameters if p.name == "load" or (p.unit == "N m" and p.lower == 0)}
    if jumps <= insignificant:
        return [p.name for p in fit.parameters if p.starts or p.name == "stribeck_gain"]
    return ["stribeck_velocity", "exponent"] if "stribeck_gain" in insignificant else []


def _clears(fit: JointFit, weak: BoolArray, velocity: Array) -> bool:
    """Check that a joint moves clearly faster than its Stribeck velocity; true if the latter is unknown."""
    if "stribeck_velocity" not in fit.names or weak[fit.names.index("stribeck_velocity")]:
        return True
    return top_speed(velocity) >= CLEARED * float(fit.values[fit.names.index("stribeck_velocity")])


def why_weak(fit: JointFit, curve: tuple[CurvePoint, ...], velocity: Array, prismatic: bool) -> Reason:
    """Describe the speed at which the friction curve is least known, and how many samples are near it."""
    point, unit = least_known(curve), "m/s" if prismatic else "rad/s"
    force, (low, high) = point.unit, point.interval_95
    residual = f"residual {fit.rms:.2g} {force} in {fit.blocks} blocks"
    if not is_significant(curve):
        return Reason(f"friction is between 0 and {upper_bound(curve):.3g} {force}", f" ({residual})")
    near = float(np.mean(np.abs(np.abs(velocity) - point.velocity) < 0.2 * curve[-1].velocity))
    text = f"friction near {point.velocity:.2g} {unit} is {low:.3g} to {high:.3g} {force}"
    return Reason(text, f" ({100 * near:.1f} % of the samples are near this speed; {residual})")


def weak_by_themselves(
    fit: JointFit, weak: BoolArray, velocity: Array, prismatic: bool, unresolved: float = np.nan
) -> str:
    """List the weak parameters and, where known, the missing motion; "" if no parameter is weak."""
    if not weak.any():
        return ""
    causes = _causes(fit, weak, velocity, prismatic, unresolved)
    named = ", ".join(name for name, is_open in zip(fit.names, weak, strict=True) if is_open)
    return f"; uncertain parameters: {named}" + (f" ({'; '.join(causes)})" if causes else "")


def _causes(fit: JointFit, weak: BoolArray, velocity: Array, prismatic: bool, unresolved: float) -> list[str]:
    values = dict(zip(fit.names, fit.values.tolist(), strict=True))
    open_ = {name for name, is_open in zip(fit.names, weak, strict=True) if is_open}
    unit = "m/s" if prismatic else "rad/s"
    causes = []
    if "stribeck_velocity" in values and open_ & {"viscous", "coulomb", "stribeck_gain", "stribeck_velocity"}:
        causes += _stribeck_causes(fit, values, open_, velocity, unit)
    if "slope" in open_:
        limit = RISING / values["slope"]
        share = float(np.mean(np.abs(velocity) < limit))
        causes.append(
            f"only {100 * share:.1f} % of the samples are slower than {limit:.2g} {unit}, where the slope matters"
        )
    if open_ & {"bristle_travel", "bristle_damping"} and values["bristle_travel"] < unresolved:
        causes.append(
            f"the joint moves {unresolved:.2g} {unit.removesuffix('/s')} after a reversal within half of the filter's "
            f"window, more than the bristle travel of {values['bristle_travel']:.2g}; reverse more slowly or log faster"
        )
    return causes


def _stribeck_causes(fit: JointFit, values: dict[str, float], open_: set[str], velocity: Array, unit: str) -> list[str]:
    speed = values["stribeck_velocity"]
    slower = float(np.mean(np.abs(velocity) < speed))
    causes, share = [], f"{100 * slower:.3g} % of the samples are slower than the Stribeck velocity, {speed:.2g} {unit}"
    inside = not fit.at_bound[fit.names.index("stribeck_velocity")]  # a Stribeck velocity at a bound is not meaningful
    if inside and slower >= 0.9:
        causes.append(share)
    elif inside and slower <= 0.02:
        causes.append(f"only {share}")
    elif "stribeck_velocity" not in open_ and (top := top_speed(velocity)) < CLEARED * speed:
        causes.append(f"the top speed, {top:.2g} {unit}, is below twice the Stribeck velocity, {speed:.2g} {unit}")
    if "stribeck_gain" in open_ and fit.intervals[fit.names.index("stribeck_gain"), 0] <= 0:
        causes.append("the log shows no clear Stribeck effect; try the law coulomb-viscous")
    return causes
