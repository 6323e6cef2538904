"""Which parameters are weak, and why, in words."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.judgement.curve import SPEEDS, WIDEST, is_significant, least_known, upper_bound
from stribeck.judgement.joint_fit import JointFit
from stribeck.judgement.speed import top_speed
from stribeck.result import CurvePoint

CLEARED = 2.0
"""Top speed over Stribeck velocity [1] beyond which a joint clears it: a fiftieth of the Stribeck effect is left."""

RISING = 2.0
"""Value of slope times speed [1] where tanh has risen to 96 %: beyond it the slope no longer shows."""


@dataclass(frozen=True, kw_only=True)
class Criteria:
    """Which parameters are weak with a method beside those with a wide interval.

    Attributes
    ----------
    assumes_exact_law
        Whether the intervals leave out that the law may be wrong: what lies beyond a Stribeck velocity that the joint
        does not clear is weak then.
    shares_shapes
        Whether the shape of a joint's curve may come from the other joints, by a group prior.
    """

    assumes_exact_law: bool = True
    shares_shapes: bool = False


USUAL = Criteria()
"""Of a fit of each joint by itself."""


def is_weak(
    fit: JointFit, velocity: Array, criteria: Criteria = USUAL, unresolved: float = np.nan
) -> NDArray[np.bool_]:
    """Return which parameters are weak, shape (p,), given the velocities of the joint's samples.

    Beside what the contract says, an interval that a bound cuts off is weak: only a zero that friction cannot pass
    is a bound of physics, any other is where the search gave up. And so is what lies beyond a Stribeck velocity that
    the joint does not clear, if the interval assumes an exact law, which decides there how the torque is shared out.
    A shape parameter from the group prior is weak where the friction that it shapes is not significant. Of bristles
    with a travel shorter than what is `unresolved` after a reversal [rad], [m], within what the filter averages over,
    the damping is weak; from a quarter of that on, so is the travel.
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
        weak[travel] |= not fit.values[travel] >= 0.25 * unresolved  # also where there is no reversal
        weak[damping] |= weak[travel] or fit.values[travel] < unresolved
    return weak


def _shape_of_nothing(fit: JointFit) -> list[str]:
    """Return the shape parameters of friction that is not significant: other joints determine them."""
    insignificant = {name for name, low in zip(fit.names, fit.intervals[:, 0], strict=True) if low <= 0}
    jumps = {each.name for each in fit.parameters if each.name == "load" or (each.unit == "N m" and each.lower == 0)}
    if jumps <= insignificant:
        return [each.name for each in fit.parameters if each.starts or each.name == "stribeck_gain"]
    return ["stribeck_velocity", "exponent"] if "stribeck_gain" in insignificant else []


def _clears(fit: JointFit, weak: NDArray[np.bool_], velocity: Array) -> bool:
    """Return whether a joint moves clearly faster than its Stribeck velocity; so does one that has no known one."""
    if "stribeck_velocity" not in fit.names or weak[fit.names.index("stribeck_velocity")]:
        return True
    return top_speed(velocity) >= CLEARED * float(fit.values[fit.names.index("stribeck_velocity")])


def why_weak(fit: JointFit, curve: tuple[CurvePoint, ...], velocity: Array, prismatic: bool) -> str:
    """Return one sentence on where a joint's friction curve is not known, and how much of the log lies there."""
    name, unit = least_known(curve), "m/s" if prismatic else "rad/s"
    point = curve[list(SPEEDS).index(name)]
    force, (low, high) = point.unit, point.interval_95
    residual = f"a residual of {fit.rms:.2g} {force} in {fit.blocks} blocks"
    if not is_significant(curve):
        return f"no friction is significant, but it may be up to {upper_bound(curve):.3g} {force}: {residual}"
    near = float(np.mean(np.abs(np.abs(velocity) - point.velocity) < 0.2 * curve[-1].velocity))
    said = (
        f"friction at {name} speed, {point.velocity:.2g} {unit}, is {point.value:.3g} ({low:.3g} to {high:.3g} {force})"
    )
    return f"{said}: {near:.1%} of the samples are near it, with {residual}"


def weak_by_themselves(
    fit: JointFit, weak: NDArray[np.bool_], velocity: Array, prismatic: bool, unresolved: float = np.nan
) -> str:
    """Return which parameters are weak, and what the log lacks for them where that is known, "" if none are."""
    if not weak.any():
        return ""
    causes = _causes(fit, weak, velocity, prismatic, unresolved)
    named = ", ".join(name for name, is_open in zip(fit.names, weak, strict=True) if is_open)
    return f"; weak by itself: {named}" + (f", as {'; '.join(causes)}" if causes else "")


def _causes(fit: JointFit, weak: NDArray[np.bool_], velocity: Array, prismatic: bool, unresolved: float) -> list[str]:
    values = dict(zip(fit.names, fit.values.tolist(), strict=True))
    open_ = {name for name, is_open in zip(fit.names, weak, strict=True) if is_open}
    unit = "m/s" if prismatic else "rad/s"
    causes = []
    if "stribeck_velocity" in values and open_ & {"viscous", "coulomb", "stribeck_gain", "stribeck_velocity"}:
        causes += _stribeck_causes(fit, values, open_, velocity, unit)
    if "slope" in open_:
        limit = RISING / values["slope"]
        share = float(np.mean(np.abs(velocity) < limit))
        causes.append(f"{share:.1%} of the samples are slower than {limit:.2g} {unit}, where the slope shows")
    if open_ & {"bristle_travel", "bristle_damping"} and values["bristle_travel"] < unresolved:
        causes.append(
            f"after a reversal it moves {unresolved:.2g} {unit.removesuffix('/s')} within half of the filter's window, "
            f"and its bristles bend on {values['bristle_travel']:.2g}: turn round more slowly, or log faster"
        )
    return causes


def _stribeck_causes(fit: JointFit, values: dict[str, float], open_: set[str], velocity: Array, unit: str) -> list[str]:
    speed = values["stribeck_velocity"]
    slower = float(np.mean(np.abs(velocity) < speed))
    causes = []
    inside = not fit.at_bound[fit.names.index("stribeck_velocity")]  # else it is no measure of slow and fast
    if inside and slower >= 0.9:
        causes.append(f"{slower:.0%} of the samples are slower than the Stribeck velocity, {speed:.2g} {unit}")
    elif inside and slower <= 0.02:
        causes.append(f"only {slower:.1%} of the samples are slower than the Stribeck velocity, {speed:.2g} {unit}")
    elif "stribeck_velocity" not in open_ and (top := top_speed(velocity)) < CLEARED * speed:
        causes.append(f"its top speed, {top:.2g} {unit}, does not clear the Stribeck velocity, {speed:.2g} {unit}")
    if "stribeck_gain" in open_ and fit.intervals[fit.names.index("stribeck_gain"), 0] <= 0:
        causes.append("there may be no Stribeck effect at all, and the law coulomb-viscous has no such parameters")
    return causes
