"""Friction at speeds above those of the log, extrapolated from the identified law and the robot's other joints.

A joint has friction c at its top speed v_top, and c + b (v - v_top) above it. The identified law has a slope b_l there.
Its error sigma combines the error of the viscous coefficient with LEVEL c / v_top, a small error of the level. Among
the joints of a robot, ln(b) is normally distributed about mu + ln(c) / 2. The estimate of b minimizes

    (b - b_l)^2 / sigma^2 + (ln b - mu - ln(c) / 2)^2 / (SPREAD^2 + error of mu^2)

mu is the mean over the joints, weighted by their information. Its weak prior is a slope of GROWTH c.
The constants were chosen on simulated arms and humanoids, and judged on other robots.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from stribeck.core.result import JointResult

REACH = {("rad/s", "N m"): 5.0, ("m/s", "N"): 1.0}
"""Speed at which friction is extrapolated, by the units of velocity and friction."""
LEVEL, SPREAD = 0.1, 0.7
"""Relative error of the friction at top speed [1], and standard deviation of ln(b) among joints [1]."""
GROWTH, DOUBT = 0.2, 1.2
"""Slope divided by the friction at top speed [s/rad], and standard deviation of its logarithm [1], before any log."""


@dataclass(frozen=True, kw_only=True)
class Beyond:
    """Friction beyond the top speed of a joint.

    Attributes
    ----------
    top, speed
        Top speed of the log, and a higher speed [rad/s], [m/s].
    friction, slope
        Friction at the higher speed [N m], [N], and its slope above the top speed [N m s/rad], [N s/m].
    units
        Units of velocity and friction.
    """

    top: float
    speed: float
    units: tuple[str, str]
    friction: float
    slope: float

    def __str__(self) -> str:
        """State the estimated friction in a sentence."""
        unit, force = self.units
        return (
            f"Above {self.top:.2g} {unit}, friction is estimated with that of the other joints: "
            f"{self.friction:.2g} {force} at {self.speed:g} {unit}"
        )


def top_speed(joint: JointResult) -> float:
    """Return the top speed of a joint's friction curve [rad/s], [m/s]."""
    return joint.curve[-1].velocity if joint.curve else max(map(abs, joint.velocity_range))


def friction_beyond(joints: Mapping[str, JointResult]) -> dict[str, Beyond]:
    """Extrapolate the friction of joints slower than 20 % of `REACH`, given all joints of the robot with friction."""
    friction: dict[str, Beyond] = {}
    for units, reach in REACH.items():
        group = {name: joint for name, joint in joints.items() if joint.units() == units}
        with np.errstate(all="ignore"):  # joints with infinite friction are skipped
            friction |= {name: beyond for name, beyond in _extrapolate(group, units, reach) if beyond.top < 0.2 * reach}
    return friction


def _extrapolate(
    joints: Mapping[str, JointResult], units: tuple[str, str], reach: float
) -> Iterator[tuple[str, Beyond]]:
    """Estimate the slopes of a group of joints beyond their top speeds."""
    top = np.array([top_speed(joint) for joint in joints.values()])
    far = np.maximum(reach, 2 * top)
    level, of_law = (np.array([*map(_resisting, joints.values(), speeds)]) for speeds in (top, far))
    slope = np.maximum(of_law - level, 0) / (far - top)
    error = np.hypot([_viscous_error(joint) for joint in joints.values()], LEVEL * level / top)
    known = np.isfinite(slope) & (level > 0) & (top > 0)
    if not known.any():
        return
    usual = np.sqrt(level * np.exp(np.mean(np.log(level[known]))))
    weight = np.where(known & (slope > 0), 1 / (SPREAD**2 + (error / slope) ** 2), 0.0)
    weighted = np.where(weight > 0, weight * np.log(slope / usual), 0.0)
    total = weight.sum() + 1 / DOUBT**2
    center = (weighted.sum() + np.log(GROWTH) / DOUBT**2) / total
    z, spread = np.linspace(-5, 5, 501), np.hypot(SPREAD, total**-0.5)
    for k in np.flatnonzero(known):
        trials = usual[k] * np.exp(center + z * spread)
        cost = ((trials - slope[k]) / error[k]) ** 2 + z**2
        best = float(trials[np.argmin(cost)])
        friction = float(level[k] + best * (reach - top[k]))
        yield list(joints)[k], Beyond(top=float(top[k]), speed=reach, units=units, friction=friction, slope=best)


def _resisting(joint: JointResult, speed: float) -> float:
    """Compute the friction at a speed, mean of both directions [N m], [N]."""
    forward, backward = joint.friction([speed, -speed])
    return float(forward - backward) / 2


def _viscous_error(joint: JointResult) -> float:
    """Compute the standard error of viscous friction; zero for laws without viscous friction."""
    names = ("viscous", "viscous_positive", "viscous_negative")
    errors = [joint.parameters[name].standard_error for name in names if name in joint.parameters]
    return float(np.nan_to_num(np.mean(errors), nan=np.inf)) if errors else 0.0
