"""Joint to plan for: friction (estimated or assumed), noise, and limits of the motion."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.ndimage import uniform_filter1d

from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.dynamics.state import State
from stribeck.core.equations.whole_log.filters import BOXES, WINDOW_LENGTH
from stribeck.core.friction import FrictionLaw, get_law
from stribeck.core.friction.law import unit_for
from stribeck.core.friction.terms import BASE, BEYOND_VELOCITY, parameters_over
from stribeck.core.judgement.curve import SPEEDS
from stribeck.core.judgement.speed import top_speed
from stribeck.core.result import JointResult, ParameterEstimate, law_slopes, law_values
from stribeck.core.settings import Settings

SHRINKING = ("noise", "overdispersion", "heterogeneity over folds", "group mean")
"""Parts of a variance that decrease with the duration of the log."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PresentMotion:
    """Motion of one joint in the log.

    Attributes
    ----------
    velocity, friction_torque
        Velocity [rad/s] and friction torque [N m] over time, shape (N,).
    usable
        Mask of samples that a fit may use, shape (N,).
    period
        Sampling period [s].
    """

    velocity: Array
    friction_torque: Array
    usable: BoolArray
    period: float

    @property
    def duration(self) -> float:
        """Duration of the usable samples [s]."""
        return float(np.count_nonzero(self.usable)) * self.period

    @property
    def top_speed(self) -> float:
        """Top speed as the verdicts define it [rad/s]."""
        return top_speed(self.velocity[self.usable])


@dataclass(frozen=True, kw_only=True)
class Reach:
    """Middle and amplitude of a joint's positions [rad], [m] and its largest speed [rad/s], [m/s]."""

    middle: float
    amplitude: float
    speed: float


@dataclass(frozen=True, eq=False, kw_only=True)
class PlannedJoint:
    """Joint whose friction a new log should identify.

    Attributes
    ----------
    column
        Index in the robot's joint order.
    result
        Result of the joint, with estimated or assumed parameters.
    guessed
        Whether the parameters are assumed.
    prismatic
        Whether the joint slides.
    settings
        Settings of the robot: priors, and the share of the top speed below which a joint is at rest.
    reach
        Limits of the motion.
    noise
        Spectral density of the torque noise [N² m² s].
    """

    column: int
    result: JointResult
    guessed: bool
    prismatic: bool
    settings: Settings
    reach: Reach
    noise: float = np.nan

    @cached_property
    def law(self) -> FrictionLaw:
        """Friction law of the joint."""
        return get_law(self.result.law)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the k parameters to identify, without temperature, drift and presliding."""
        known = parameters_over("temperature", "time", "travel")
        return tuple(name for name in self.result.parameters if name not in known)

    @cached_property
    def values(self) -> Array:
        """Values of these parameters, shape (k,)."""
        return np.array([self.result.parameters[name].value for name in self.names])

    @cached_property
    def _scales(self) -> BoolArray:
        scales = {parameter.name for parameter in self.law.parameters if parameter.logarithmic}
        return np.array([name in scales for name in self.names], dtype=bool)

    @cached_property
    def units(self) -> Array:
        """Units of the coordinates, shape (k,): logarithms for scales, plain values for the others."""
        return np.where(self._scales, self.values, 1.0)

    @cached_property
    def precision(self) -> Array:
        """Precision of the priors of the coordinates, shape (k,)."""
        priors = self.settings.priors
        size = priors.friction * max(np.abs(self.values).max(initial=0.0), 1.0)
        pure = np.array([self.result.parameters[name].unit == "1" for name in self.names], dtype=bool)
        deviation = np.where(self._scales, priors.scale, np.where(pure, priors.pure_number, size))
        return np.asarray(deviation**-2)

    @cached_property
    def _law_at(self) -> tuple[Array, Array]:
        """Values of the law, and their derivatives with respect to the k parameters."""
        values = law_values(self.law, self.result.values)
        assert values is not None, "a joint with a curve has all parameters that its law needs"
        columns = [list(self.result.parameters).index(name) for name in self.names]
        return values, law_slopes(self.law, self.result.values)[:, columns]

    def columns(self, velocity: Array, acceleration: Array, load: Array | None, position: Array | None) -> Array:
        """Compute the derivatives of the friction torque with respect to the coordinates, shape (T, k)."""
        values, slopes = self._law_at
        columns = self.law.jacobian(velocity, values) @ slopes
        beyond = {parameter.name for parameter in BEYOND_VELOCITY}  # friction is linear in these
        for k, name in enumerate(self.names):
            if name == "armature":
                columns[:, k] = acceleration
            elif name in beyond:
                estimate = self.result.parameters[name]
                more = {**self.result.parameters, name: replace(estimate, value=estimate.value + 1)}
                columns[:, k] = replace(self.result, parameters=more).friction(velocity, load, 0.0, position)
                columns[:, k] -= self.result.friction(velocity, load, 0.0, position)
        return np.asarray(columns * self.units)

    def moves(self, velocity: Array) -> BoolArray:
        """Find the samples that are not at rest, shape (T,)."""
        if not self.law.jumps:
            return np.ones(len(velocity), dtype=bool)
        return np.asarray(np.abs(velocity) >= self.settings.rest * top_speed(velocity))

    def curve(self, speed: float) -> tuple[Array, Array, Array]:
        """Compute speeds, friction, shape (3,) each, and its derivatives with respect to the coordinates, shape (3, k).

        Friction is the mean of both directions at the mean load, as in the verdicts.
        """
        speeds = speed * np.array(list(SPEEDS.values()))
        forward, backward = (self.columns(sign * speeds, np.zeros(len(speeds)), None, None) for sign in (1, -1))
        value = (self.result.friction(speeds) - self.result.friction(-speeds)) / 2
        return speeds, value, (forward - backward) / 2

    def information(self, motion: PresentMotion, pace: float = 1.0) -> Array:
        """Compute the information of a motion about the coordinates for noise of density 1, shape (k, k).

        `pace` is a factor of the speed.
        """
        velocity = pace * motion.velocity
        columns = averaged(self.columns(velocity, np.zeros(len(velocity)), None, None), motion.period)
        counted = motion.usable & self.moves(velocity)
        return np.asarray(columns[counted].T @ columns[counted] * motion.period)

    @cached_property
    def shrinking_share(self) -> float:
        """Share of the curve's variance that decreases with the duration of the log [1].

        It is the mean over the parameters, weighted by their contribution to the curve's variance.
        """
        slopes = self.curve(self.result.curve[-1].velocity)[2]
        terms = [self.result.parameters[name] for name in self.names]
        weight = np.mean(slopes**2, axis=0) * np.array([term.standard_error for term in terms]) ** 2 / self.units**2
        parts = [{"noise": 1.0} if term.variance_shares is None else term.variance_shares for term in terms]
        shares = [sum(part.get(name, 0.0) for name in SHRINKING) for part in parts]
        return float(np.average(shares, weights=weight)) if weight.sum() > 0 else 1.0

    @property
    def fixed_part(self) -> str:
        """Name of the largest part of the variances that does not decrease with the duration, "" if none."""
        shares = [estimate.variance_shares for estimate in self.result.parameters.values() if estimate.variance_shares]
        names = {name for share in shares for name in share if name not in SHRINKING}
        return max(sorted(names), key=lambda name: sum(share.get(name, 0.0) for share in shares), default="")


def guess(joint: JointResult, others: Sequence[JointResult]) -> JointResult:
    """Assume the median parameters of other joints with a curve; without any, initial values of a fit, or 0.

    For the law "auto", only the terms that every joint has are assumed.
    """
    speed = float(np.median([other.curve[-1].velocity for other in others] or [1.0]))
    parameters = {}
    for parameter in get_law(joint.law).parameters:
        if parameter.neutral is not None and parameter.name not in BASE | {"offset"}:
            continue
        values = [other.parameters[parameter.name].value for other in others if parameter.name in other.parameters]
        starts = [start * speed**parameter.start_speed_power for start in parameter.starts]
        value = 0.0 if parameter.name == "offset" else float(np.median(values or starts or [0.0]))
        parameters[parameter.name] = ParameterEstimate(
            value=value,
            standard_error=0.0,
            interval_95=(value, value),
            unit=unit_for(parameter, prismatic=False),
            verdict="weak",
        )
    return replace(joint, parameters=parameters)


def moving(posture: Array, joints: int | list[int], part: State) -> State:
    """Build the motion of all joints from the motion of some; the others rest in the posture."""
    position = np.tile(posture, (len(part.position), 1))
    velocity, acceleration = np.zeros((2, *position.shape))
    position[:, joints], velocity[:, joints], acceleration[:, joints] = part.position, part.velocity, part.acceleration
    return State(position, velocity, acceleration)


def averaged(columns: Array, period: float) -> Array:
    """Average columns over time, shape (T, k), like a window of the whole-log method."""
    length = max(1, round((WINDOW_LENGTH / period + BOXES - 1) / BOXES))
    for _ in range(BOXES if length > 1 else 0):
        columns = uniform_filter1d(columns, length, axis=0)
    return columns
