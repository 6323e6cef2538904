"""Corrections of model and calibration, and repeated errors, in units of what is believed of them beforehand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stribeck.identification.whole_log.model.bodies import Bodies, bodies_of
from stribeck.identification.whole_log.model.layout import ModelLayout, layout_of
from stribeck.inertial_parameters import SIZE
from stribeck.settings import Priors
from stribeck.typing import Array
from stribeck.weak_equations import Corrections

SUM_OF_GAINS = 1e-3
"""How far the mean gain may be from 1, in units of its prior: one gain that all torques share is friction's scale."""

LEAST_LOAD = 0.05
"""Torque of a sensor over that of the most loaded one [1] from which its gain is corrected and counts in the mean.

Gains of lighter limbs come out wrong by some percent, as noise is in their torques and in the motion that their bodies
are corrected with; gains being right on average, the legs' would make up for that.
"""


@dataclass(frozen=True, eq=False)
class ModelCorrections:
    """Corrections x of the equations' columns as functions of c coordinates with unit prior.

    Attributes
    ----------
    corrections
        What there is to correct.
    bodies
        Where the inertias start from.
    loaded
        Which of the torque sensors have gains that are corrected; they are right on average.
    layout
        Of their coordinates, and of those of random effects, whose standard deviation is one.
    prior_std
        Standard deviations of the coordinates of `corrections` before the log speaks [1], shape (corrections.size,).
    priors
        Units of the coordinates.
    overdispersion
        How many times larger the squared errors are than they are taken to be [1] when it comes to the model.
    """

    corrections: Corrections
    bodies: Bodies
    loaded: NDArray[np.int64]
    layout: ModelLayout
    prior_std: Array
    priors: Priors
    overdispersion: float = 1.0

    @property
    def size(self) -> int:
        """Number of coordinates c."""
        return self.layout.size

    @property
    def common_gain(self) -> float:
        """Standard deviation of the mean gain [1], which no log tells."""
        own = self.prior_std[self.layout.part("gains")][self.loaded]
        return self.priors.torque_gain * float(np.linalg.norm(own)) / max(len(self.loaded), 1)

    @property
    def precision(self) -> Array:
        """Inverse covariance of the coordinates before the log speaks, shape (c, c).

        Where a log is doubted it is of what is believed, times the doubt: as if it had been the shorter by as much.
        """
        diagonal = np.ones(self.size)
        diagonal[self.layout.corrections] = self.prior_std**-2
        diagonal[self.layout.nearly_right] *= self.overdispersion
        precision = np.diag(diagonal)
        if len(self.loaded):
            gains = np.arange(self.size)[self.layout.part("gains")][self.loaded]
            precision[np.ix_(gains, gains)] += 1 / (len(gains) * SUM_OF_GAINS) ** 2
        return precision

    def values(self, coordinates: Array) -> tuple[Array, Array]:
        """Return x, shape (c,), and the bodies' derivatives, shape (L, 10, 10); the others' are `scales`."""
        bodies = self.layout.part("bodies")
        changes, slopes = self.bodies.corrections(coordinates[bodies].reshape(-1, SIZE))
        return np.concatenate([changes.ravel(), self.scales * coordinates[bodies.stop :]]), slopes

    @property
    def scales(self) -> Array:
        """Units of the coordinates of calibration and random effects."""
        c, priors = self.corrections, self.priors
        sensors = np.repeat([priors.torque_gain, priors.encoder_zero, priors.imu_tilt], [c.gains, c.zeros, c.tilts])
        wrench = np.repeat([priors.wrench_force, priors.wrench_moment, priors.wrench_gain], [3, 3, 1])
        calibration = np.concatenate([sensors, np.tile(wrench, c.wrenches), np.full(len(c.rotors), priors.rotor)])
        calibration[np.setdiff1d(np.arange(c.gains), self.loaded)] = 0.0
        return np.concatenate([calibration, np.ones(self.size - self.corrections.size)])


def model_corrections(corrections: Corrections, loads: Array, priors: Priors) -> ModelCorrections:
    """Return the coordinates of what there is to correct, without repeated errors.

    `loads` are the torques that the sensors see, root mean square [N m], shape (gains,). The gains of those that carry
    next to nothing are left alone: they cannot be told from friction, and noise would be taken for them.
    """
    loaded = np.flatnonzero(loads > LEAST_LOAD * loads.max(initial=0.0))
    bodies = bodies_of(corrections.inertial_parameters, priors)
    return ModelCorrections(corrections, bodies, loaded, layout_of(corrections), np.ones(corrections.size), priors)
