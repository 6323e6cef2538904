"""Errors that come back with every step: what is wrong at the same place of a gait, time and again.

Feet rock alike after every lift-off, a tilt or an inertia that is off is off alike in every step. Such errors do not
average out over steps; taken for noise they would make intervals too narrow. So every gait phase may have a smooth
torque of its own in each joint, a few cosines over the phase. The friction itself is better found without these; how
large they are, what it leaves over says, and its covariance is what they would do to it.

Of a rocking foot next to nothing is left over: bodies whose centres are off take up what it does to them, with offsets
to match. How much feet rock from window to window is measured; that they do so alike in all steps, and by how much
more, is assumed (`ROCKING` in `repeated.py`).
"""

from __future__ import annotations

import numpy as np

from stribeck.identification.whole_log.noise.autocorrelation import autocorrelation
from stribeck.typing import Array
from stribeck.weak_equations import WeakEquations

COSINES = 4
"""Of each error and gait phase [1], the constant included."""


def random_effect_columns(equations: WeakEquations) -> Array:
    """Return the equations' derivatives by the cosines of their own gait phase, shape (K m, COSINES (n + turns)).

    Beside the n torques of the joints they are of the root's angular accelerations: three where it has any. These are
    units of noise that fades within a few windows: such noise, the same in every phase of a length T, is the sum of
    cosines whose factors have the variance 2 reach / T, and half of that the constant one, its correlation reaching so
    far in all.
    """
    whole = np.isfinite(equations.since + equations.until)
    length = np.where(whole, equations.since + equations.until, 1.0)
    progress = np.where(whole, equations.since / length, 0.5)  # a phase that is cut off: its middle, as it were
    reach = (equations.time[1] - equations.time[0]) * (2 * autocorrelation(equations.lags).sum() - 1)
    waves = np.cos(np.pi * progress[:, None] * np.arange(COSINES))[:, None, :, None]
    noise = waves * np.sqrt(np.r_[1, np.full(COSINES - 1, 2)] * reach / length[:, None])[:, None, :, None]
    torques, turns = waves * equations.weights[:, :, None], noise * equations.root_response[:, :, None, 3:]
    return np.concatenate([torques, turns], axis=3).reshape(equations.residual.size, -1)
