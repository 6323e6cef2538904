"""The contract of a friction law."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stribeck.typing import Array

PRISMATIC_UNITS = {
    "N m": "N",
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
    4. Write `basis` and `from_linear`: with the nonlinear parameters (those with `starts`) fixed, the law is
       `basis @ coefficients`; `from_linear` turns the coefficients into parameters. Fits start from there. Give
       `free_coefficients`, the indices of the coefficients that may be negative; the others may not. Set `jumps` if
       R jumps at standstill: samples at rest are then left out of its fits.
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

    @abc.abstractmethod
    def basis(self, velocity: Array, shape: Mapping[str, float]) -> Array:
        """Return the columns that the linear coefficients multiply, shape (N, k), for given nonlinear parameters."""

    @abc.abstractmethod
    def from_linear(self, coefficients: Array, shape: Mapping[str, float]) -> Array:
        """Return parameter values, shape (p,), within their bounds, from linear coefficients, shape (k,)."""
