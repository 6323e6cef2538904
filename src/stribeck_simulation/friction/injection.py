"""How friction enters a simulator: linear in a velocity that each physics step is yet to find.

    R = D u + c

with u the velocity in the middle of the step, which is what positions before and after it show. Close to standstill
friction is so steep (tanh(40 v) with 1 N m is a damper of 40 N m s/rad) that a step that adds R(v) as a force chatters
on light links. Each step therefore takes D as implicit damping, c as an applied torque, and logs the R that has really
acted, once u is known.
"""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck_simulation.friction.parameters import Parameters
from stribeck_simulation.span import span


class Instant(NamedTuple):
    """State at the start of a physics step.

    Attributes
    ----------
    time, step
        [s]
    position, velocity, torque
        Values of all joints, shape (n,); velocity is predicted for the middle of the step, torque is the sensors'.
    """

    time: float
    step: float
    position: Array
    velocity: Array
    torque: Array


class FrictionEffect(Protocol):
    """Friction torque between sensor and link at some joints.

    To add one, write a class with these members in a new file. One object serves one run and may keep a state.
    """

    columns: NDArray[np.int64]
    parameters: Parameters

    def linearise(self, instant: Instant) -> tuple[Array, Array]:
        """Compute D [N m s/rad], not negative, and c [N m] of these joints over the coming step, shape (k,) each."""
        ...

    def advance(self, velocity: Array) -> None:
        """Take the step's velocity u of these joints, shape (k,)."""
        ...


class FrictionTruth:
    """All that resists the joints of one run. Each physics step calls `before`, as often as it likes, then `after`.

    Parameters
    ----------
    joints
        Number of joints n.
    effects
        They add up.

    Attributes
    ----------
    parameters
        Of all effects, by joint and name, for the truth beside a log.
    """

    def __init__(self, joints: int, effects: Sequence[FrictionEffect] = ()) -> None:
        self._effects = tuple(effects)
        self._columns = [span(effect.columns) for effect in self._effects]
        self.parameters: dict[str, dict[str, float]] = {}
        for effect in self._effects:
            for joint, named in effect.parameters.items():
                self.parameters.setdefault(joint, {}).update(named)
        self._damping, self._offset = np.zeros((2, joints))

    def before(self, instant: Instant) -> tuple[Array, Array]:
        """Compute D [N m s/rad], to be used as implicit damping, and c [N m], to be subtracted, shape (n,) each."""
        self._damping, self._offset = np.zeros((2, len(instant.velocity)))
        for effect, columns in zip(self._effects, self._columns, strict=True):
            damping, offset = effect.linearise(instant)
            self._damping[columns] += damping
            self._offset[columns] += offset
        return self._damping, self._offset

    def after(self, velocity: Array) -> Array:
        """Build the friction torque that acted [N m], shape (n,), given the step's velocity u, shape (n,)."""
        for effect, columns in zip(self._effects, self._columns, strict=True):
            effect.advance(velocity[columns])
        return self._damping * velocity + self._offset
