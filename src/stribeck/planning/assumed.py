"""The friction that a motion is planned for: what was found, or what the robot's other joints suggest."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from stribeck.friction import get_law
from stribeck.friction.law import Parameter, unit_for
from stribeck.friction.terms import BASE, BEYOND_VELOCITY, LADDER
from stribeck.identification.judgement.curve import SPEEDS
from stribeck.identification.judgement.speed import top_speed
from stribeck.result import JointResult, ParameterEstimate, law_slopes, law_values
from stribeck.settings import Priors
from stribeck.typing import Array

BEYOND = {parameter.name for parameter in BEYOND_VELOCITY}
"""Names of parameters of friction that is no function of velocity alone."""

CONSTANT = ("temperature", "drift")
"""Terms whose covariate no motion can choose: they are taken to be known."""


@dataclass(frozen=True, eq=False)
class AssumedFriction:
    """Friction of one joint, and which of its parameters a new log has to find.

    Attributes
    ----------
    joint
        Its parameters are those found, or a guess.
    guessed
        Whether the log says nothing about it.
    prismatic
        Whether it slides.
    priors
        Standard deviations before any log.
    rest
        Share of the top speed below which the joint is at rest, if its law jumps there, and says nothing [1].
    """

    joint: JointResult
    guessed: bool
    prismatic: bool
    priors: Priors
    rest: float

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the k parameters that a log has to find."""
        known = {name for term in LADDER if term.name.endswith(CONSTANT) for name in term.parameters}
        return tuple(name for name in self.joint.parameters if name not in known and name != "presliding")

    @cached_property
    def values(self) -> Array:
        """Their values, shape (k,)."""
        return np.array([self.joint.parameters[name].value for name in self.names])

    @cached_property
    def units(self) -> Array:
        """Units of the coordinates, shape (k,): a scale has its logarithm, all others are as they are."""
        return np.where([self._is_scale(name) for name in self.names], self.values, 1.0)

    @cached_property
    def precision(self) -> Array:
        """Of the priors of the coordinates, shape (k,)."""
        size = self.priors.friction * max(np.abs(self.values).max(initial=0.0), 1.0)
        own = np.full(len(self.names), size)
        for k, name in enumerate(self.names):
            if self._is_scale(name):
                own[k] = self.priors.scale
            elif self.joint.parameters[name].unit == "1":
                own[k] = self.priors.pure_number
        return np.asarray(own**-2)

    def _is_scale(self, name: str) -> bool:
        return any(each.name == name and each.logarithmic for each in get_law(self.joint.law).parameters)

    def columns(self, velocity: Array, acceleration: Array, load: Array | None, position: Array | None) -> Array:
        """Return the derivatives of the friction torque by the coordinates, shape (T, k)."""
        law, names = get_law(self.joint.law), list(self.joint.parameters)
        found = (
            law.jacobian(velocity, self._law_values) @ self._law_slopes[:, [names.index(name) for name in self.names]]
        )
        for k, name in enumerate(self.names):
            if name == "armature":
                found[:, k] = acceleration
            elif name in BEYOND:  # in which friction is linear
                ends = [
                    self._with(name, self.joint.parameters[name].value + each).friction(velocity, load, 0.0, position)
                    for each in (1, 0)
                ]
                found[:, k] = ends[0] - ends[1]
        return np.asarray(found * self.units)

    @cached_property
    def _law_values(self) -> Array:
        values = law_values(get_law(self.joint.law), {name: own.value for name, own in self.joint.parameters.items()})
        assert values is not None, "a joint with a curve has what its law needs"
        return values

    @cached_property
    def _law_slopes(self) -> Array:
        return law_slopes(get_law(self.joint.law), {name: own.value for name, own in self.joint.parameters.items()})

    def _with(self, name: str, value: float) -> JointResult:
        own = replace(self.joint.parameters[name], value=value)
        return replace(self.joint, parameters={**self.joint.parameters, name: own})

    def moves(self, velocity: Array) -> NDArray[np.bool_]:
        """Return which samples are not at rest, shape (T,)."""
        if not get_law(self.joint.law).jumps:
            return np.ones(len(velocity), dtype=bool)
        return np.asarray(np.abs(velocity) >= self.rest * top_speed(velocity))

    def curve(self, speed: float) -> tuple[Array, Array, Array]:
        """Return speeds, friction there and its derivatives by the coordinates, shapes (3,), (3,) and (3, k).

        It is the mean of both directions at slow, middle and top speed, as in a result.
        """
        speeds = speed * np.array(list(SPEEDS.values()))
        zero = np.zeros(len(speeds))
        forward, backward = (self.columns(sign * speeds, zero, None, None) for sign in (1, -1))
        value = (self.joint.friction(speeds) - self.joint.friction(-speeds)) / 2
        return speeds, value, (forward - backward) / 2


def guess(joint: JointResult, others: Sequence[JointResult]) -> JointResult:
    """Return a joint with parameters as the others have them in the middle; of the law "auto" the usual ones."""
    law = get_law(joint.law)
    kept = [each for each in law.parameters if each.neutral is None or each.name in BASE | {"offset"}]
    return replace(joint, parameters={each.name: _middle(each, others) for each in kept})


def _middle(parameter: Parameter, others: Sequence[JointResult]) -> ParameterEstimate:
    """Return the median of a parameter over joints; where none has it, of the starts of its fit, or 0."""
    found = [other.parameters[parameter.name].value for other in others if parameter.name in other.parameters]
    if parameter.name == "offset":
        found = [0.0]
    speeds = [other.curve[-1].velocity for other in others if other.curve] or [1.0]
    starts = [start * float(np.median(speeds)) ** parameter.start_speed_power for start in parameter.starts]
    value = float(np.median(found or starts or [0.0]))
    return ParameterEstimate(
        value=value,
        standard_error=0.0,
        interval_95=(value, value),
        unit=unit_for(parameter, prismatic=False),
        verdict="weak",
    )
