"""Random effects of the gait phase: errors that recur in every step (docs/estimator-fit.md, equation 28).

Feet rock in the same way after every lift-off, and an inertia that is wrong is wrong in every step. Such errors do not
average out over steps; treated as noise, they would make intervals too narrow. Therefore every joint may have a smooth
torque in each gait phase, some cosines over its progress. The fit omits them; its covariance includes their effect.

A rocking foot leaves hardly any residual, because corrections of centers of mass absorb it. The standard deviation of
the root's random effect is therefore assumed: `ROOT_EFFECT_FACTOR` times that from window to window.
"""

import numpy as np

from stribeck.base.typing import Array
from stribeck.whole_log.constants import COSINES
from stribeck.whole_log.noise.variance_components import autocorrelation
from stribeck.whole_log.weak_equations import WeakEquations


def random_effect_columns(equations: WeakEquations) -> Array:
    """Compute the equations' derivatives by the cosines of their gait phase, shape (K m, COSINES (n + turns)).

    The effects are n joint torques and, for a free root, three angular accelerations. Their unit is noise with the
    autocorrelation (8). Such noise, the same in every phase of a length T, is a sum of cosines with variances 2 reach /
    T (half as much for the constant), where the reach is the integral of the autocorrelation.
    """
    whole = np.isfinite(equations.since + equations.until)
    length = np.where(whole, equations.since + equations.until, 1.0)
    progress = np.where(whole, equations.since / length, 0.5)  # a phase that is cut off counts as its middle
    reach = (equations.time[1] - equations.time[0]) * (2 * autocorrelation(equations.lags).sum() - 1)
    waves = np.cos(np.pi * progress[:, None] * np.arange(COSINES))[:, None, :, None]
    noise = waves * np.sqrt(np.r_[1, np.full(COSINES - 1, 2)] * reach / length[:, None])[:, None, :, None]
    torques, turns = waves * equations.weights[:, :, None], noise * equations.root_response[:, :, None, 3:]
    return np.concatenate([torques, turns], axis=3).reshape(equations.residual.size, -1)
