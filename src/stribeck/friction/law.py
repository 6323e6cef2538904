"""The contract of a friction law."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stribeck.log import Array


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A named, bounded parameter with a unit; `unit` is for a revolute joint.

    `starts` is only for parameters that enter nonlinearly: the values a fit tries. `logarithmic` parameters are
    scales, whose intervals are symmetric in their logarithm.
    """

    name: str
    symbol: str
    unit: str
    lower: float = 0.0
    upper: float = np.inf
    starts: tuple[float, ...] = ()
    logarithmic: bool = False


class FrictionLaw(abc.ABC):
    """Friction torque as a function of velocity: R(v), positive for positive velocity.

    To add a law:

    1. Write `friction/<name>.py` with a subclass; its docstring has the equation, when to use it, and the source.
    2. Give `name` (as typed after `--law`), `title` and `parameters`. Every parameter is positive where it
       dissipates; an `offset` may have either sign. Keep to the names that the other laws use.
    3. Write `torque` and its derivatives `jacobian` (same order as `parameters`).
    4. Write `basis` and `from_linear`: with the nonlinear parameters (those with `starts`) fixed, the law is
       `basis @ coefficients`; `from_linear` turns the coefficients into parameters. Fits start from there.
    5. Add the class to `LAWS` in `friction/__init__.py`. The tests of `tests/friction/test_laws.py` then check it:
       dissipation, derivatives, the linear form, recovery from wrong starts.
    6. Add a page to `docs/laws/`.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]]

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
