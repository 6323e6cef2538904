"""Interface between friction and a simulator: friction is linear in the unknown velocity of each physics step.

    R = D u + c

u is the velocity in the middle of the step, the difference of the positions before and after it. Near standstill,
friction is steep: tanh(40 v) with 1 N m is a damper of 40 N m s/rad. If a step applied R(v) as an explicit force, light
links would chatter. Each step therefore uses D as implicit damping and c as an applied torque. When u is known, it logs
the applied R.
"""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.simulation.friction.parameters import Parameters
from stribeck.simulation.span import span


class Instant(NamedTuple):
    """State at the start of a physics step.

    Attributes
    ----------
    time, step
        Time and length of the step [s].
    position, velocity, torque
        Values of all joints, shape (n,): velocity predicted for the middle of the step, and torque at the sensors.
    """

    time: float
    step: float
    position: Array
    velocity: Array
    torque: Array


class FrictionEffect(Protocol):
    """Friction torque between sensor and link at some joints.

    To add an effect, write a class with these members in a new file. An object is used for one run, and may have a
    state.
    """

    columns: NDArray[np.int64]
    parameters: Parameters

    def linearise(self, instant: Instant) -> tuple[Array, Array]:
        """Compute D [N m s/rad], not negative, and c [N m] of these joints over the coming step, shape (k,) each."""
        ...

    def advance(self, velocity: Array) -> None:
        """Update the state by the step's velocity u of these joints, shape (k,)."""
        ...


class FrictionTruth:
    """Total joint friction of one run. Each physics step calls `before` at least once, then `after`.

    Parameters
    ----------
    joints
        Number of joints n.
    effects
        Effects, whose torques are added.

    Attributes
    ----------
    parameters
        Parameters of all effects, by joint and name, for the ground truth of a log.
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
        """Compute D [N m s/rad] for implicit damping, and c [N m] to subtract from the torque, shape (n,) each."""
        self._damping, self._offset = np.zeros((2, len(instant.velocity)))
        for effect, columns in zip(self._effects, self._columns, strict=True):
            damping, offset = effect.linearise(instant)
            self._damping[columns] += damping
            self._offset[columns] += offset
        return self._damping, self._offset

    def after(self, velocity: Array) -> Array:
        """Compute the applied friction torque [N m], shape (n,), from the step's velocity u, shape (n,)."""
        for effect, columns in zip(self._effects, self._columns, strict=True):
            effect.advance(velocity[columns])
        return self._damping * velocity + self._offset
