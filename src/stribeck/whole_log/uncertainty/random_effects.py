"""Random effects of the gait phase: errors that recur at the same place of every step (docs/estimator.md, equation 28).

Feet rock in the same way after every lift-off, and an inertia that is wrong is wrong in every step. Such errors do not
average out over steps; taken for noise they would make intervals too narrow. So every joint may have a smooth torque in
each gait phase, some cosines over its progress. The fit leaves them out; its covariance has their effect on it.

A rocking foot leaves hardly any residual, as centres of mass take it up. The standard deviation of the root's random
effect is therefore assumed: `ROOT_EFFECT_FACTOR` times that from window to window.
"""

import numpy as np

from stribeck.base.typing import Array
from stribeck.whole_log.constants import COSINES
from stribeck.whole_log.noise.variance_components import autocorrelation
from stribeck.whole_log.weak_equations import WeakEquations


def random_effect_columns(equations: WeakEquations) -> Array:
    """Return the equations' derivatives by the cosines of their own gait phase, shape (K m, COSINES (n + turns)).

    Beside the n torques of the joints they are of the root's angular accelerations: three where it has any. Their
    unit is noise with the autocorrelation (8): such noise, the same in every phase of a length T, is the sum of cosines
    of the variances 2 reach / T, half of that of the constant, with the reach the integral of the autocorrelation.
    """
    whole = np.isfinite(equations.since + equations.until)
    length = np.where(whole, equations.since + equations.until, 1.0)
    progress = np.where(whole, equations.since / length, 0.5)  # a phase that is cut off counts as its middle
    reach = (equations.time[1] - equations.time[0]) * (2 * autocorrelation(equations.lags).sum() - 1)
    waves = np.cos(np.pi * progress[:, None] * np.arange(COSINES))[:, None, :, None]
    noise = waves * np.sqrt(np.r_[1, np.full(COSINES - 1, 2)] * reach / length[:, None])[:, None, :, None]
    torques, turns = waves * equations.weights[:, :, None], noise * equations.root_response[:, :, None, 3:]
    return np.concatenate([torques, turns], axis=3).reshape(equations.residual.size, -1)
