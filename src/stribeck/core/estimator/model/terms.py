"""Columns in addition to the law: terms of friction (`friction/terms`), and errors that look like friction.

| error | columns |
|---|---|
| play | blows when the torque changes its sign, and one window later |
| rotor | acceleration |
| gain | this torque |
| delay | minus the change of this torque with time |

Settings of all columns come from the pilot, so that they are known before the log is read.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.equations.weak_equations import WeakEquations
from stribeck.core.estimator.model.basis import Basis
from stribeck.core.friction.terms import LADDER
from stribeck.core.friction.terms.term import Term, evaluate, linear

_PLAY = tuple(linear(name, name, "N m") for name in ("play", "rebound"))
ERRORS: tuple[Term, ...] = (
    Term(name="play", parameters=_PLAY, columns=("blow", "rebound"), misfit="play", words="play"),
    Term(name="rotor", parameters=(linear("rotor", "I", "kg m^2"),), columns=("acceleration",)),
    Term(name="gain", parameters=(linear("gain", "g", "1"),), columns=("torque",)),
    Term(
        name="delay",
        parameters=(linear("delay", "d", "1"),),
        columns=("change",),
        misfit="delay",
        words="a delay of this torque only",
    ),
)
"""Errors that look like friction; the delay is in units of the prior of delays [1]."""

NO_TERM = frozenset(name for term in ERRORS for name in term.names)
"""Parameters of columns that model errors, not friction."""


LAGS = (0.5e-3, 2e-3, 8e-3)
"""Travels of the pilot's presliding, divided by the top speed [s]; presliding resembles a delay."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Terms:
    """Terms that n joints may have, and the settings of their columns.

    Attributes
    ----------
    mean_temperature
        Mean temperatures [deg C], shape (n,); None if the log has no temperatures, so that drift replaces them.
    duration
        Duration of the longest log [s].
    direction
        Mean cosine and sine of each joint's position, shape (n, 2).
    slope
        Slope of the friction's rise at standstill [s/rad], shape (n,).
    friction
        Coefficients of the pilot's curves, shape (n, R), for computing the torque that reaches the link.
    top_speed, unexplained
        Top speed [rad/s], and the pilot's residual torque, root mean square [N m], shape (n,).
    delay
        Unit of delays [s].
    settings
        Settings of the terms by name, shape (n,) each; NaN for joints without the term.
    """

    mean_temperature: Array | None
    duration: float
    direction: Array
    slope: Array
    friction: Array
    top_speed: Array
    unexplained: Array
    delay: float
    settings: Mapping[str, Array] = field(default_factory=dict)

    @cached_property
    def own(self) -> list[Term]:
        """Terms with columns that some joint can have, then errors."""
        absent = "temperature" if self.mean_temperature is None else "time"
        terms = [term for term in (*LADDER, *ERRORS) if term.columns and term.over != absent]
        return [term for term in terms if all(np.isfinite(self.settings[name]).any() for name in term.settings)]

    @property
    def size(self) -> int:
        """Number of columns."""
        return len(self.parameters)

    @cached_property
    def parameters(self) -> tuple[Any, ...]:
        """Parameters of the columns, in order."""
        return tuple(parameter for term in self.own for parameter in term.parameters)

    @property
    def held(self) -> list[bool]:
        """Mask of columns that the pilot does not fit: a torque resembles friction too much."""
        return [parameter.name == "gain" for parameter in self.parameters]

    def columns(self, part: WeakEquations, windows: Array) -> Array:
        """Return the columns, shape (K, n, T), given the windows of the basis, shape (K, n, R)."""
        signals = {**self.signals(part, windows), **self._error_signals(part)}
        columns = [np.nan_to_num(evaluate(column, signals)) for term in self.own for column in term.columns]
        return np.stack(columns, axis=2)

    def _error_signals(self, part: WeakEquations) -> dict[str, Array]:
        """Collect the signals of `ERRORS`, shape (K, n)."""
        change, acceleration = np.zeros((2, *part.torque.shape))
        if len(part.time) > 1:
            acceleration = part.windows(np.gradient(part.velocity, part.period, axis=0))
            change -= self.delay * np.gradient(part.torque, part.time, axis=0)
        blow, rebound = _blows(part, self.unexplained)
        return {"blow": blow, "rebound": rebound, "acceleration": acceleration, "torque": part.torque, "change": change}

    def signals(self, part: WeakEquations, windows: Array) -> dict[str, Any]:
        """Collect the signals of `Term.columns` through windows, shape (K, n)."""
        middle, warmer = 0.5 * self.duration, np.full(part.torque.shape, np.nan)
        if part.temperature is not None and self.mean_temperature is not None:
            warmer = part.temperature - self.mean_temperature
        since = 0.5 * (part.elapsed - middle) / middle
        return {
            "velocity": part.windows(part.velocity),
            "rise": part.windows(np.tanh(self.slope * part.velocity)),
            "load": self.load(part, windows),
            "temperature": warmer,
            "elapsed": np.broadcast_to(since[:, None], part.torque.shape),
            "position": part.position,
            "near": part.position,
            "mean_cosine": self.direction[:, 0],
            "mean_sine": self.direction[:, 1],
            "abs": np.abs,
            "cos": lambda angle: part.windows(np.cos(angle)),
            "sin": lambda angle: part.windows(np.sin(angle)),
            "tanh": lambda argument: part.windows(np.tanh(argument)),
            "lag": lambda travel: part.presliding(self.top_speed, travel[None])[0],
            **self.settings,
        }

    def load(self, part: WeakEquations, windows: Array) -> Array:
        """Compute the size of the torque that joints carry [N m], shape (K, n); zero for a coupling.

        A joint with its own equation gets the torque of inverse dynamics, because the measured torque contains the
        equation's error. Other joints get the measured torque without friction.
        """
        if part.projection is None:
            return np.abs(part.torque - part.residual)
        friction = np.einsum("kjr,jr->kj", windows, self.friction)
        if part.couplings is not None:
            friction[:, : part.joints] += friction[:, part.joints :] @ part.couplings.T
            friction[:, part.joints :] = 0.0
        return np.asarray(np.abs(part.torque - friction))


@dataclass(frozen=True, eq=False)
class Lags:
    """Columns of presliding for these travels, and joints with a top speed [rad/s], shape (n,)."""

    top_speed: Array
    size: int = len(LAGS)
    held: ClassVar[list[bool]] = [False] * len(LAGS)

    def columns(self, part: WeakEquations, windows: Array) -> Array:  # noqa: ARG002 - other terms need them
        """Return the columns, shape (K, n, 3)."""
        return np.moveaxis(part.presliding(self.top_speed, np.outer(LAGS, self.top_speed)), 0, 2)

    def load(self, part: WeakEquations, windows: Array) -> Array:  # noqa: ARG002 - not used yet
        """Return zeros, shape (K, n)."""
        return np.zeros_like(part.torque)


@dataclass(frozen=True, eq=False)
class Columns:
    """Friction columns of the equations: q per joint, for its curve and its terms."""

    basis: Basis
    terms: Terms | Lags

    @property
    def per_joint(self) -> int:
        """Number q of columns."""
        return int(self.basis.functions.shape[1]) + self.terms.size

    def by_joint(self, part: WeakEquations) -> Array:
        """Compute the columns as windowed friction torques, shape (K, n, q)."""
        windows = self.basis.windows(part.velocity, part.taps, part.step, len(part.residual))
        return np.concatenate([windows, self.terms.columns(part, windows)], axis=2)

    def design(self, part: WeakEquations, columns: Array, *behind: Array) -> Array:
        """Join the derivatives of the equations by coefficients, by corrections, and the additional columns `behind`.

        The result has shape (K m, D), each of `behind` (K m, any), and the joints' `columns` (K, n, q). These are
        zero where a joint's friction does not act.
        """
        windows, rows = part.residual.shape
        friction = columns.shape[1] * columns.shape[2]
        end = friction + (0 if part.regressors is None else part.regressors.shape[2])
        matrix = np.empty((windows, rows, end + sum(block.shape[1] for block in behind)))
        by_joint = matrix[:, :, :friction].reshape(windows, rows, *columns.shape[1:])  # a view: its last axis in two
        if part.projection is None:
            by_joint[:] = 0.0
            np.einsum("kjjr->kjr", by_joint)[:] = columns
        else:
            np.multiply(part.projection[:, :, :, None], columns[:, None], out=by_joint)
        if part.regressors is not None:
            matrix[:, :, friction:end] = part.regressors
        if behind:
            matrix[:, :, end:] = np.concatenate(behind, axis=1).reshape(windows, rows, -1)
        return matrix.reshape(windows * rows, -1)


def _blows(part: WeakEquations, unexplained: Array) -> list[Array]:
    """Find blows in the torque's new direction at each change of its sign, and one window later, shape (K, n) each.

    While a light bar of damping d crosses a play of width p, the torque moves nothing but the bar: d y' = tau. Whatever
    the torque, friction takes the impulse d p away, within some milliseconds. The window's largest value counts as one.
    A change of the sign is sure beyond six standard deviations of the torque's noise, and beyond twice the pilot's
    residual, because colored noise changes signs too.
    """
    torque, taps = part.torque, part.taps
    change = np.diff(torque, axis=0)
    clear = np.maximum(6 * part.torque_noise * np.sqrt(part.torque_overlap[0]), 2 * unexplained)
    window, joint = np.nonzero((torque[:-1] * torque[1:] < 0) & (np.abs(change) > clear))
    place = window - torque[window, joint] / change[window, joint]  # in windows
    reach = len(taps) // (2 * part.step) + 1
    rows = window[:, None] + np.arange(1 - reach, reach + 1)
    shape = np.interp((rows - place[:, None]) * part.step + (len(taps) - 1) / 2, np.arange(len(taps)), taps)
    shape[(rows < 0) | (rows >= len(torque))] = 0.0
    blows = np.zeros_like(torque)
    strength = np.sign(change[window, joint])[:, None] * shape / taps.max()
    np.add.at(blows, (np.clip(rows, 0, len(torque) - 1), joint[:, None]), strength)
    return [blows, np.concatenate([np.zeros_like(blows[:1]), blows[:-1]])]
