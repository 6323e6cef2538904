"""Base classes of friction laws."""

import abc
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from stribeck.core.base.typing import Array, BoolArray


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """Named, bounded parameter with a unit; `unit` is for a revolute joint, see `unit_for`.

    `starts` are the values that a fit of a nonlinear parameter starts from, times the joint's top speed to the power
    `start_speed_power`, so that they suit slow and fast, revolute and prismatic joints. A `logarithmic` parameter is a
    scale with an interval that is symmetric in its logarithm. `neutral` is the value of a joint without this term, and
    of a coupling without an offset.
    """

    name: str
    symbol: str
    unit: str
    lower: float = 0.0
    upper: float = np.inf
    starts: tuple[float, ...] = ()
    start_speed_power: int = 0
    logarithmic: bool = False
    neutral: float | None = None


def unit_for(parameter: Parameter, prismatic: bool, torque: str = "") -> str:
    """Return the unit of a parameter for a revolute or a prismatic joint whose torque has a unit, N m or N if empty."""
    unit = parameter.unit
    if prismatic:
        unit = unit.replace("N m", "N").replace("kg m^2", "kg").replace("rad", "m")
    return unit.replace("N" if prismatic else "N m", torque) if torque else unit


class FrictionLaw(abc.ABC):
    """Friction torque as a function of velocity: R(v), positive for positive velocity.

    To add a law:

    1. Write `friction/<name>.py` with a subclass; its docstring has the equation, when to use it, and the source.
    2. Give `name` (as typed after `--law`), `title` and `parameters`. Every parameter is positive where it
       dissipates; an `offset` may have either sign. Parameters that several laws share are in `parameters.py`.
    3. Write `torque` and its derivatives `jacobian` (same order as `parameters`); both finite within the bounds at
       any finite velocity.
    4. Unless the law is linear in all parameters, write `basis` and `from_linear`: with fixed nonlinear parameters (the
       ones with `starts`), the law is `basis @ coefficients`; `from_linear` converts the coefficients to parameters.
       Fits start from there. Give `free_coefficients`, the indices of the coefficients that may be negative. Set
       `jumps` if R jumps at standstill: its fits then exclude samples at rest.
    5. Declare the class in the group `stribeck.laws` of pyproject.toml. `tests/friction/test_laws.py` then checks it:
       dissipation, derivatives, the linear form, recovery from wrong starts.
    6. Draw it in `studies/paper/law_figures.py` (`python -m studies.paper chapter3`), and add a page to `docs/laws/`
       and to the navigation in `docs/conf.py`.

    For a law in your own program, do steps 2 to 4 and call `register_law`.

    Examples
    --------
    >>> import numpy as np
    >>> from stribeck.core.friction import get_law
    >>> law = get_law("coulomb-viscous")
    >>> isinstance(law, FrictionLaw), [parameter.name for parameter in law.parameters]
    (True, ['viscous', 'coulomb', 'offset'])
    >>> law.torque(np.array([-1.0, 0.0, 2.0]), np.array([0.5, 1.0, 0.0]))
    array([-1.5,  0. ,  2. ])
    """

    name: ClassVar[str]
    title: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]]
    free_coefficients: ClassVar[tuple[int, ...]] = ()
    jumps: ClassVar[bool] = False

    @abc.abstractmethod
    def torque(self, velocity: Array, values: Array) -> Array:
        """Compute R(v) [N m], shape (N,), from velocity [rad/s], shape (N,), and parameter values, shape (p,)."""

    @abc.abstractmethod
    def jacobian(self, velocity: Array, values: Array) -> Array:
        """Compute dR/dp, shape (N, p)."""

    def resisting(self, velocity: Array, values: Array) -> Array:
        """Compute the mean of both directions, (R(v) - R(-v)) / 2 [N m], shape (N,), without the offset."""
        return (self.torque(velocity, values) - self.torque(-velocity, values)) / 2

    def basis(self, velocity: Array, shape: Mapping[str, float]) -> Array:  # noqa: ARG002 - the law is linear
        """Compute the columns that the linear coefficients multiply, shape (N, k), for given nonlinear parameters."""
        return self.jacobian(velocity, np.zeros(len(self.parameters)))

    def from_linear(self, coefficients: Array, shape: Mapping[str, float]) -> Array:  # noqa: ARG002
        """Compute parameter values, shape (p,), within their bounds, from linear coefficients, shape (k,)."""
        return np.clip(coefficients, [p.lower for p in self.parameters], [p.upper for p in self.parameters])


@dataclass(frozen=True, eq=False, kw_only=True)
class Motion:
    """Motion of a joint in segments without gaps.

    Attributes
    ----------
    velocity
        Velocity [rad/s], shape (M,).
    period
        Time between the velocities of a segment [s].
    begins
        Whether each velocity is the first of a segment, shape (M,).
    """

    velocity: Array
    period: float
    begins: BoolArray

    @cached_property
    def legs(self) -> tuple[Array, Array]:
        """Mean velocity [rad/s] and length [rad] of paths in one direction, two per sample, shape (2 M,).

        The velocity is linear between samples. The first leg ends where the velocity changes its sign, otherwise
        halfway. The path before the start of a segment is infinitely long.
        """
        after = self.velocity
        before = np.append(after[:1], after[:-1])
        turns = before * after < 0
        share = np.divide(before, before - after, out=np.full_like(after, 0.5), where=turns)
        middle = np.where(turns, 0.0, (before + after) / 2)
        velocity = np.column_stack([(before + middle) / 2, (middle + after) / 2])
        path = self.period * np.column_stack([share, 1.0 - share]) * np.abs(velocity)
        velocity[self.begins], path[self.begins] = after[self.begins, None], np.inf
        return velocity.ravel(), path.ravel()


class LawWithState(FrictionLaw):
    """Friction that depends on the past motion; the methods of `FrictionLaw` refer to steady sliding.

    Segments of a motion start in steady sliding. `torque_along`, `jacobian_along` and `basis_along` are `torque`,
    `jacobian` and `basis` along a motion. `basis_along` only provides starts of fits, so it may neglect how the state
    depends on the parameters.
    """

    @abc.abstractmethod
    def torque_along(self, motion: Motion, values: Array) -> Array:
        """Compute R along a motion [N m], shape (M,), for parameter values, shape (p,)."""

    @abc.abstractmethod
    def jacobian_along(self, motion: Motion, values: Array) -> Array:
        """Compute dR/dp along a motion, shape (M, p)."""

    @abc.abstractmethod
    def basis_along(self, motion: Motion, shape: Mapping[str, float]) -> Array:
        """Compute the columns that the linear coefficients multiply, shape (M, k), for given nonlinear parameters."""
