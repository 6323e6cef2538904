"""Columns of terms in addition to the law: friction that changes with load, temperature or time, position and travel.

With s the rise of the friction at standstill, tanh(a v), a joint's columns are, through the window,

| term | columns |
|---|---|
| load | |torque that reaches the link| s |
| coulomb_temperature, viscous_temperature | degrees above the mean times s, and times v |
| coulomb_drift, viscous_drift | time, from -1/2 at the beginning of a log to 1/2 at its end, times s, and times v |
| coulomb_position | cosine and sine of the position, minus their means, times s |
| ripple | cos(k q), sin(k q), k periods per turn |
| presliding | z - s(v), the deficit of friction that builds up over a travel (`friction/presliding.py`) |
| play | blows when the torque changes its sign, and one window later |
| rotor | acceleration |
| gain | this torque |
| delay | minus the change of this torque with time |

The last four are not friction, but errors that look like friction to a fit. The slope a, k and the travel come from
the pilot, so that all columns are known before the log is read. Load: Hamon, Gautier and Garrec 2010; temperature:
Bittencourt and Gunnarsson 2012; presliding: Dahl 1968.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import compress
from typing import Protocol

import numpy as np

from stribeck.base.typing import Array
from stribeck.friction import Parameter
from stribeck.friction.terms import LOAD, POSITION, PRESLIDING, RIPPLE, SLOW
from stribeck.whole_log.model.basis import Basis
from stribeck.whole_log.weak_equations import WeakEquations

PLAY = tuple(
    Parameter(name=name, symbol=name, unit="N m", lower=float("-inf"), neutral=0.0) for name in ("play", "rebound")
)
ROTOR = Parameter(name="rotor", symbol="I", unit="kg m^2", lower=float("-inf"), neutral=0.0)
DELAY = Parameter(name="delay", symbol="d", unit="1", lower=float("-inf"), neutral=0.0)
"""Parameter of a torque delay, in units of the prior of delays [1]."""

SHORTEST_DRIFT = 20.0
"""Shortest log for terms of drift [s], chosen by judgment."""

GAIN = Parameter(name="gain", symbol="g", unit="1", lower=float("-inf"), neutral=0.0)
"""Share of a torque that is the error of its gain."""

NO_TERM = frozenset(parameter.name for parameter in (*PLAY, ROTOR, GAIN, DELAY))
"""Parameters of columns that model errors, not friction."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Terms:
    """Settings of the columns of n joints; without `slope` there are no columns.

    Attributes
    ----------
    slow
        Cause of slow changes of friction: "temperature" or "drift".
    middle
        Mean temperatures [deg C], shape (n,), or half the length of the longest log [s].
    direction
        Mean cosine and sine of each joint's position, shape (n, 2).
    slope
        Slope of the friction's rise at standstill [s/rad], shape (n,).
    per_turn, travel
        Periods per turn of each joint's torque ripple [1], and travel of its presliding [rad], shape (n,); NaN for
        none.
    friction
        Coefficients of the pilot's curves, shape (n, R), for computing the torque that reaches the link.
    top_speed, unexplained
        Top speed [rad/s], and the pilot's residual torque, root mean square [N m], shape (n,).
    delay
        Unit of delays [s].
    """

    slow: str
    middle: Array
    direction: Array
    slope: Array
    per_turn: Array
    travel: Array
    friction: Array
    top_speed: Array
    unexplained: Array
    delay: float

    @property
    def size(self) -> int:
        """Number of columns."""
        return len(self.parameters)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Names of the columns' parameters, in order."""
        return tuple(
            compress(
                (LOAD, *SLOW[self.slow], *POSITION, *RIPPLE, PRESLIDING, *PLAY, ROTOR, GAIN, DELAY), self._possible
            )
        )

    @property
    def held(self) -> list[bool]:
        """Mask of columns that the pilot does not fit: a torque resembles friction too much."""
        return [parameter is GAIN for parameter in self.parameters]

    @property
    def _possible(self) -> list[bool]:
        """Mask of columns that some joint can have."""
        ripple, presliding = (bool(np.isfinite(each).any()) for each in (self.per_turn, self.travel))
        return [True, True, True, True, True, ripple, ripple, presliding, True, True, True, True, True]

    @property
    def mean_temperature(self) -> Array:
        """Mean temperature of each joint [deg C], NaN without a logged temperature, shape (n,)."""
        return self.middle if self.slow == "temperature" else np.full(len(self.direction), np.nan)

    def columns(self, part: WeakEquations, windows: Array) -> Array:
        """Return the columns, shape (K, n, T), given the windows of the basis, shape (K, n, R)."""
        rise, speed = part.windows(np.tanh(self.slope * part.velocity)), part.windows(part.velocity)
        slow, around = self._slow(part), np.nan_to_num(part.direction() - self.direction)
        ripple = np.nan_to_num(part.direction(self.per_turn))
        lag = np.nan_to_num(part.presliding(self.top_speed, self.travel[None])[0])
        late, acceleration = np.zeros((2, *part.torque.shape))
        if len(part.time) > 1:
            acceleration = part.windows(np.gradient(part.velocity, part.period, axis=0))
            late -= self.delay * np.gradient(part.torque, part.time, axis=0)
        turned = np.moveaxis(around * rise[:, :, None], 2, 0)
        own = [self.load(part, windows) * rise, slow * rise, slow * speed, *turned, *np.moveaxis(ripple, 2, 0), lag]
        errors = [*_blows(part, self.unexplained), acceleration, part.torque, late]
        return np.stack(list(compress([*own, *errors], self._possible)), axis=2)

    def load(self, part: WeakEquations, windows: Array) -> Array:
        """Compute the size of the torque that joints carry [N m], shape (K, n); zero for a coupling.

        A joint with its own equation gets the torque of inverse dynamics, because the measured torque contains the
        equation's error. Other joints get the measured torque without friction.
        """
        if part.projection is None:
            return np.abs(part.torque - part.residual)
        own = np.einsum("kjr,jr->kj", windows, self.friction)
        if part.couplings is not None:
            own[:, : part.joints] += own[:, part.joints :] @ part.couplings.T
            own[:, part.joints :] = 0.0
        return np.asarray(np.abs(part.torque - own))

    def _slow(self, part: WeakEquations) -> Array:
        if self.slow == "temperature" and part.temperature is not None:
            return np.asarray(np.nan_to_num(part.temperature - self.middle))
        since = 0.5 * (part.elapsed - self.middle) / self.middle
        return np.broadcast_to(since[:, None], part.torque.shape)


class Beside(Protocol):
    """Columns in addition to the curves, T per joint."""

    @property
    def size(self) -> int:
        """Number T of columns per joint."""

    @property
    def held(self) -> list[bool]:
        """Mask of columns that the pilot does not fit."""

    def columns(self, part: WeakEquations, windows: Array) -> Array:
        """Return the columns, shape (K, n, T), given the windows of the basis, shape (K, n, R)."""

    def load(self, part: WeakEquations, windows: Array) -> Array:
        """Compute the absolute torque that joints carry [N m], shape (K, n)."""


@dataclass(frozen=True, eq=False)
class Columns:
    """Friction columns of the equations: q per joint, for its curve and its terms."""

    basis: Basis
    terms: Beside

    @property
    def per_joint(self) -> int:
        """Number q of columns."""
        return int(self.basis.functions.shape[1]) + self.terms.size

    def by_joint(self, part: WeakEquations) -> Array:
        """Compute the columns as windowed friction torques, shape (K, n, q)."""
        windows = self.basis.windows(part.velocity, part.taps, part.step, len(part.residual))
        return np.concatenate([windows, self.terms.columns(part, windows)], axis=2)

    def design(self, part: WeakEquations, own: Array, *behind: Array) -> Array:
        """Join the derivatives of the equations by coefficients, by corrections, and the additional columns `behind`.

        The result has shape (K m, D), each of `behind` (K m, any), and the joints' `own` columns (K, n, q). These are
        zero where a joint's friction does not act.
        """
        windows, rows = part.residual.shape
        friction = own.shape[1] * own.shape[2]
        end = friction + (0 if part.regressors is None else part.regressors.shape[2])
        matrix = np.empty((windows, rows, end + sum(each.shape[1] for each in behind)))
        by_joint = matrix[:, :, :friction].reshape(windows, rows, *own.shape[1:])  # a view: its last axis in two
        if part.projection is None:
            by_joint[:] = 0.0
            np.einsum("kjjr->kjr", by_joint)[:] = own
        else:
            np.multiply(part.projection[:, :, :, None], own[:, None], out=by_joint)
        if part.regressors is not None:
            matrix[:, :, friction:end] = part.regressors
        if behind:
            matrix[:, :, end:] = np.concatenate(behind, axis=1).reshape(windows, rows, -1)
        return matrix.reshape(windows * rows, -1)


def find_terms(pilot: Sequence[WeakEquations], **known: Array | float) -> Terms:
    """Compute the terms' settings from equations over the entire log; `known` are the other attributes of `Terms`."""
    temperature = [part.temperature for part in pilot if part.temperature is not None]
    logged = len(temperature) == len(pilot) and bool(np.isfinite(np.concatenate(temperature)).any())
    middle = np.full(1, max(0.5 * _last(pilot), 1e-9))
    if logged:
        whole = np.concatenate(temperature)
        there = np.isfinite(whole)
        total, count = np.where(there, whole, 0.0).sum(axis=0), there.sum(axis=0)
        middle = np.where(count, total / np.maximum(count, 1), np.nan)
    direction = np.concatenate([part.direction() for part in pilot]).mean(axis=0)
    slow = "temperature" if logged else "drift"
    return Terms(slow=slow, middle=middle, direction=direction, **known)  # type: ignore[arg-type]


def unsupported(pilot: Sequence[WeakEquations], terms: Terms, mean: Array, deviation: Array) -> list[dict[str, str]]:
    """List each joint's excluded terms with the reason.

    Parameters
    ----------
    pilot
        Equations from the beginning to the end of a log.
    terms
        Settings of the log's terms.
    mean, deviation
        Mean and standard deviation of each joint's load [N m], shape (n,).
    """
    turns = np.sqrt(np.concatenate([part.direction() for part in pilot]).var(axis=0).sum(axis=1))
    reasons = []
    for joint, turned in enumerate(turns):
        temperature = [part.temperature[:, joint] for part in pilot if part.temperature is not None]
        out = _slow_reasons(terms.slow, _last(pilot), temperature)
        if not deviation[joint] > 0.1 * mean[joint]:
            out["load"] = f"its load hardly changes: {mean[joint]:.3g} N m +- {deviation[joint]:.2g}"
        if not turned >= 0.1:  # [rad]
            said = "it is prismatic" if np.isnan(turned) else f"+- {turned:.2g} rad"
            out["coulomb_position"] = f"its position hardly turns: {said}"
        if np.isnan(terms.per_turn[joint]):
            out["ripple"] = "its motion spans too little of a turn, or is none"
        if np.isnan(terms.travel[joint]):
            out["presliding"] = "no travel explains more of its torque than shorter and longer ones do"
        reasons.append(out)
    return reasons


def _last(pilot: Sequence[WeakEquations]) -> float:
    """Compute the duration of a log [s]."""
    return max(float(part.elapsed[-1]) for part in pilot)


def _slow_reasons(slow: str, last: float, temperature: list[Array]) -> dict[str, str]:
    """Explain, by term, why a joint's log cannot show a change of friction with temperature or with time."""
    warming, drifting = "", "the log has temperatures, which say more than time"
    if slow == "drift":
        warming = "no temperature in the log"
        drifting = f"the log lasts {last:.3g} s; {SHORTEST_DRIFT:.0f} s are needed" if last < SHORTEST_DRIFT else ""
    else:
        own = np.concatenate(temperature)
        if not np.isfinite(own).all():
            warming = "the log has no temperature of this joint throughout"
        elif np.ptp(own) < 2.0:
            warming = f"its temperature changes by {np.ptp(own):.2g} K; 2 K are needed"
    reasons = {"temperature": warming, "drift": drifting}
    return {f"{part}_{kind}": why for kind, why in reasons.items() if why for part in ("viscous", "coulomb")}


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
