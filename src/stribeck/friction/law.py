"""The contract of a friction law."""

import abc
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array

PRISMATIC_UNITS = {
    "N m": "N",
    "rad": "m",
    "N m s/rad": "N s/m",
    "rad/s": "m/s",
    "s/rad": "s/m",
    "kg m^2": "kg",
    "N m/K": "N/K",
    "N m s/(rad K)": "N s/(m K)",
}
"""Unit of a revolute joint's parameter -> unit of the same parameter of a prismatic joint."""


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A named, bounded parameter with a unit; `unit` is for a revolute joint, see `unit_for`.

    `starts` is only for parameters that enter nonlinearly: the values a fit tries, times the joint's top speed to the
    power `start_speed_power`, so that one grid suits slow and fast, revolute and prismatic joints. `logarithmic`
    parameters are scales, whose intervals are symmetric in their logarithm. `neutral` is the value of a joint that does
    without the parameter, of laws whose joints may, and of a coupling without an offset.
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


def unit_for(parameter: Parameter, prismatic: bool) -> str:
    """Return the unit of a parameter of a revolute or a prismatic joint, e.g. "N m" or "N"."""
    return PRISMATIC_UNITS.get(parameter.unit, parameter.unit) if prismatic else parameter.unit


class FrictionLaw(abc.ABC):
    """Friction torque as a function of velocity: R(v), positive for positive velocity.

    To add a law:

    1. Write `friction/<name>.py` with a subclass; its docstring has the equation, when to use it, and the source.
    2. Give `name` (as typed after `--law`), `title` and `parameters`. Every parameter is positive where it
       dissipates; an `offset` may have either sign. Those that several laws share are in `parameters.py`.
    3. Write `torque` and its derivatives `jacobian` (same order as `parameters`); both finite within the bounds at
       any finite velocity.
    4. Unless the law is linear in all parameters, write `basis` and `from_linear`: with the nonlinear parameters (those
       with `starts`) fixed, the law is `basis @ coefficients`; `from_linear` turns the coefficients into parameters.
       Fits start from there. Give `free_coefficients`, the indices of the coefficients that may be negative; the others
       may not. Set `jumps` if R jumps at standstill: samples at rest are then left out of its fits.
    5. Add the class to `LAWS` in `friction/__init__.py`. The tests of `tests/friction/test_laws.py` then check it:
       dissipation, derivatives, the linear form, recovery from wrong starts.
    6. Draw it in `studies/paper/law_figures.py` (`python -m studies.paper chapter3`), and add a page to `docs/laws/`
       and to the navigation in `docs/conf.py`.

    A law of your own, that only your program knows, needs steps 2 to 4 and `register_law`.

    Examples
    --------
    >>> import numpy as np
    >>> from stribeck.friction import get_law
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
        """Return R(v) [N m], shape (N,), for velocity [rad/s], shape (N,), and parameter values, shape (p,)."""

    @abc.abstractmethod
    def jacobian(self, velocity: Array, values: Array) -> Array:
        """Return dR/dp, shape (N, p)."""

    def basis(self, velocity: Array, shape: Mapping[str, float]) -> Array:  # noqa: ARG002 - the law is linear
        """Return the columns that the linear coefficients multiply, shape (N, k), for given nonlinear parameters."""
        return self.jacobian(velocity, np.zeros(len(self.parameters)))

    def from_linear(self, coefficients: Array, shape: Mapping[str, float]) -> Array:  # noqa: ARG002
        """Return parameter values, shape (p,), within their bounds, from linear coefficients, shape (k,)."""
        return np.clip(coefficients, [each.lower for each in self.parameters], [each.upper for each in self.parameters])


@dataclass(frozen=True, eq=False, kw_only=True)
class Motion:
    """How a joint moves, in pieces without a break.

    Attributes
    ----------
    velocity
        [rad/s], shape (M,).
    period
        From one velocity of a piece to the next [s].
    begins
        Which velocities are the first of a piece, shape (M,).
    """

    velocity: Array
    period: float
    begins: NDArray[np.bool_]

    @cached_property
    def legs(self) -> tuple[Array, Array]:
        """Mean velocity [rad/s] and length [rad] of paths in one direction, two to each sample, shape (2 M,).

        The velocity is linear between samples; the first leg ends where it changes its sign, else halfway. What led to
        the beginning of a piece is infinitely long.
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
    """Friction that depends on the motion before; what the other methods return is that of steady sliding.

    A motion's pieces begin steadily. `torque_along`, `jacobian_along` and `basis_along` are `torque`, `jacobian` and
    `basis` along a motion; starts alone come from the last, which may neglect what its state owes to the parameters.
    """

    @abc.abstractmethod
    def torque_along(self, motion: Motion, values: Array) -> Array:
        """Return R along a motion [N m], shape (M,), for parameter values, shape (p,)."""

    @abc.abstractmethod
    def jacobian_along(self, motion: Motion, values: Array) -> Array:
        """Return dR/dp along a motion, shape (M, p)."""

    @abc.abstractmethod
    def basis_along(self, motion: Motion, shape: Mapping[str, float]) -> Array:
        """Return the columns that the linear coefficients multiply, shape (M, k), for given nonlinear parameters."""
