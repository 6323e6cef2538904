"""Errors that come back with every step: what is wrong at the same place of a gait, time and again.

Feet rock alike after every lift-off, a tilt or an inertia that is off is off alike in every step. Such errors do not
average out over steps; taken for noise they would make intervals too narrow. So every gait phase may have a smooth
torque of its own in each joint, a few cosines over the phase. The friction itself is better found without these; how
large they are, what it leaves over says, and its covariance is what they would do to it.
"""

from __future__ import annotations

import numpy as np

from stribeck.equations import WeakEquations
from stribeck.log import Array

COSINES = 4
"""Of each joint and gait phase [1], the constant included."""


def repeated_columns(equations: WeakEquations) -> Array:
    """Return the equations' derivatives by the cosines of their own gait phase, shape (K m, COSINES n)."""
    whole = np.isfinite(equations.since + equations.until)
    length = np.where(whole, equations.since + equations.until, 1.0)
    progress = np.where(whole, equations.since / length, 0.5)  # a phase that is cut off: its middle, as it were
    waves = np.cos(np.pi * progress[:, None] * np.arange(COSINES))
    columns = waves[:, None, :, None] * equations.weights[:, :, None, :]
    return np.asarray(columns.reshape(equations.residual.size, -1))
