"""Columns of the alternative terms: friction that no law of velocity describes (docs/estimator.md, "Score tests").

Per joint, with s(v) a smooth sign of the velocity, tau the torque that the sensor measures, t the time since the log
began, and z Dahl's deflection, which follows s(v) within a distance d of travel (Dahl 1968):

| what | columns |
|---|---|
| load | (|tau| / mean |tau| - 1) s(v), beside the sensor's gain |
| drift | (2 t / T - 1) s(v), (2 t / T - 1) v / top speed |
| presliding | z - s(v), of a short and of a long distance, where the encoder resolves them |
| play | blows when tau changes its sign, and 10 ms later: what a bar takes away while it crosses its play |
| delay | -dtau/dt of this torque alone |
| ripple | cos and sin of k q, k periods a turn, as `model/ripple.py` finds |
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.friction.presliding import SMOOTH_SIGN
from stribeck.whole_log.constants import (
    PRESLIDING_TIMES,
    SIGN_CHANGE,
    UNEXPLAINED_CHANGE,
)
from stribeck.whole_log.model.ripple import by_joint
from stribeck.whole_log.weak_equations import WeakEquations

DELAY, RIPPLE = "delay", "ripple"
KINDS = {"load": (0,), "drift": (2, 3), "presliding": (4, 5), "play": (6, 7), DELAY: (8,), RIPPLE: (9, 10)}
"""Kinds of alternative terms, and their columns."""

GAIN_COLUMN, COLUMNS = 1, 11

NO_TORQUE = 1e-9
"""Mean torque [N m] of a joint that logs none: it has no friction to be tested."""


@dataclass(frozen=True, eq=False)
class AlternativeTerms:
    """Scales of the columns of n joints.

    Attributes
    ----------
    top_speed, torque
        Of the joints, the mean one [rad/s], [N m], shape (n,).
    duration
        T [s].
    gain, delay
        Units of gains [1] and of delays [s] of torque sensors.
    unexplained
        What the pilot fit leaves of a joint's torque, root mean square [N m], shape (n,).
    per_turn
        Periods of a ripple a turn [1], shape (n,); NaN of a joint where none is looked for.
    """

    top_speed: Array
    torque: Array
    duration: float
    gain: float
    delay: float
    unexplained: Array
    per_turn: Array

    @property
    def size(self) -> int:
        """Number of columns."""
        return COLUMNS * len(self.top_speed)

    def columns(self, equations: WeakEquations) -> Array:
        """Return the equations' derivatives by all columns, joint by joint, shape (K m, n COLUMNS)."""
        torques = self.torques(equations)
        columns = equations.weights[:, :, :, None] * torques[:, None]
        return np.asarray(columns.reshape(-1, self.size))

    def torques(self, equations: WeakEquations) -> Array:
        """Return the columns as friction torques, through the window, shape (K, n, COLUMNS)."""
        sign = np.tanh(equations.velocity / (SMOOTH_SIGN * self.top_speed))
        s, speed = (equations.windows(each) for each in (sign, equations.velocity / self.top_speed))
        lags = equations.presliding(self.top_speed, np.outer(PRESLIDING_TIMES, self.top_speed))
        lagging = [lag * self._resolved(equations) for lag in lags]
        load = np.abs(_around(equations)) / self.torque - 1
        time = (2 * equations.elapsed / self.duration - 1)[:, None]
        late = -self.delay * _slope(equations)
        of_velocity = [time * s, time * speed, *lagging]
        others = [*_blows(equations, self.unexplained), late, *self._rippling(equations)]
        return np.stack([load * s, self.gain * equations.torque, *of_velocity, *others], axis=2)

    def _resolved(self, equations: WeakEquations) -> NDArray[np.bool_]:
        """Return in which joints an encoder's step is shorter than the shortest presliding, shape (n,).

        A coarser one sees a reversal late, which looks like friction that builds up after it.
        """
        if equations.position_noise is None:
            return np.ones(len(self.top_speed), dtype=bool)
        step = np.sqrt(12) * equations.position_noise  # of a rounded position
        return np.asarray(step < min(PRESLIDING_TIMES) * self.top_speed)

    def _rippling(self, equations: WeakEquations) -> list[Array]:
        """Return cosine and sine of so many times the position, through the window, shape (K, n) each."""
        return list(np.moveaxis(np.nan_to_num(equations.direction(self.per_turn)), 2, 0))


def find_alternatives(
    pilot: Sequence[WeakEquations],
    residuals: Sequence[Array],
    variances: Sequence[Array],
    top_speed: Array,
    gain: float,
    delay: float,
    per_turn: Array,
) -> AlternativeTerms:
    """Return the alternative terms of a log, scaled by `pilot` equations that reach to its end.

    Residuals of the pilot fit, and their variances, have shape (K, m) each; `per_turn` are the periods of a ripple to
    look for.
    """
    torque = np.abs(np.concatenate([part.torque for part in pilot])).mean(axis=0)
    last = max(float(part.elapsed[-1]) for part in pilot)
    score, known = by_joint(pilot, residuals, variances)
    squares = (score**2 / np.maximum(known, 1e-300)).sum(axis=0)
    return AlternativeTerms(
        top_speed,
        np.maximum(torque, NO_TORQUE),
        max(last, 1e-9),
        gain,
        delay,
        np.sqrt(squares / np.maximum(known.sum(axis=0), 1e-300)),
        per_turn,
    )


def _slope(equations: WeakEquations) -> Array:
    """Return the change of each torque with time [N m/s], shape (K, n)."""
    if len(equations.time) == 1:
        return np.zeros_like(equations.torque)
    return np.asarray(np.gradient(equations.torque, equations.time, axis=0))


def _around(equations: WeakEquations) -> Array:
    """Return the torque at each window, shape (K, n), from windows before and after that share no sample with it.

    Its own noise is in the equation as well: |tau| would go up wherever the noise pulls the way that the joint moves.
    """
    away, last = equations.lags + 1, len(equations.torque) - 1
    k = np.arange(last + 1)
    before, after = np.where(k < away, k + away, k - away), np.where(k + away > last, k - away, k + away)
    return np.asarray(equations.torque[np.clip([before, after], 0, last)].mean(axis=0))


def _blows(equations: WeakEquations, unexplained: Array) -> list[Array]:
    """Return blows in the torque's new direction wherever it changes its sign, and one window later, shape (K, n) each.

    While a light bar of damping d crosses a play of width p, the torque moves nothing but the bar: d y' = tau. Whatever
    the torque, friction takes the impulse d p away, within some milliseconds. The window's largest value counts as one.
    """
    torque, taps = equations.torque, equations.taps
    change = np.diff(torque, axis=0)
    noise = equations.torque_noise * np.linalg.norm(taps)
    clear = np.maximum(SIGN_CHANGE * noise, UNEXPLAINED_CHANGE * unexplained)
    turns = (torque[:-1] * torque[1:] < 0) & (np.abs(change) > clear)
    window, joint = np.nonzero(turns)
    place = window - torque[window, joint] / change[window, joint]  # in windows
    reach = len(taps) // (2 * equations.step) + 1
    rows = window[:, None] + np.arange(1 - reach, reach + 1)
    shape = np.interp((rows - place[:, None]) * equations.step + (len(taps) - 1) / 2, np.arange(len(taps)), taps)
    shape[(rows < 0) | (rows >= len(torque))] = 0.0
    blows = np.zeros_like(torque)
    strength = np.sign(change[window, joint])[:, None] * shape / taps.max()
    np.add.at(blows, (np.clip(rows, 0, len(torque) - 1), joint[:, None]), strength)
    return [blows, np.concatenate([np.zeros_like(blows[:1]), blows[:-1]])]
