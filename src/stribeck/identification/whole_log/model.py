"""Corrections of model and calibration, and repeated errors, in units of what is believed of them beforehand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stribeck.identification.whole_log.bodies import Bodies, bodies_of
from stribeck.identification.whole_log.cosines import COSINES
from stribeck.inertial_parameters import SIZE
from stribeck.typing import Array
from stribeck.weak_equations import WRENCH_SIZE, Corrections

GAIN, ZERO, TILT = 0.01, 2e-3, 5e-3
"""How wrong sensors are believed to be: torque gains [1], encoder zeros [rad], orientation of the IMU [rad]."""

FORCE, MOMENT, WRENCH_GAIN = 20.0, 2.0, 0.02
"""How far off wrench sensors in feet are believed to be: zeros [N], [N m], and gains [1]."""

ROTOR = 1.0
"""How large a rotor inertia that the model lacks may well be [kg m^2]."""

SUM_OF_GAINS = 1e-3
"""How far the mean gain may be from 1, in units of `GAIN`: one gain common to all torques is friction's own scale."""

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
    gaits
        Number of gait phases whose repeated errors are looked for.
    repeated
        Standard deviations of the repeated errors: of each joint's torque [N m] and the root's turns, shape (n + 3,) or
        (n,).
    spread
        Standard deviations of the coordinates of `corrections` before the log speaks [1], shape (corrections.size,).
    doubt
        How many times larger the squared errors are than they are taken to be [1] when it comes to the model.
    """

    corrections: Corrections
    bodies: Bodies
    loaded: NDArray[np.int64]
    gaits: int
    repeated: Array
    spread: Array
    doubt: float = 1.0

    @property
    def size(self) -> int:
        """Number of coordinates c."""
        return self.corrections.size + self.gaits * COSINES * len(self.repeated)

    @property
    def believed(self) -> int:
        """Number of the first coordinates, those of model and sensors that are about right: no wrenches, no rotors."""
        return self.corrections.size - WRENCH_SIZE * self.corrections.wrenches - len(self.corrections.rotors)

    @property
    def common_gain(self) -> float:
        """Standard deviation of the mean gain [1], which no log tells."""
        first = self.corrections.inertial_parameters.size
        return GAIN * float(np.linalg.norm(self.spread[first + self.loaded])) / max(len(self.loaded), 1)

    @property
    def precision(self) -> Array:
        """Inverse covariance of the coordinates before the log speaks, shape (c, c).

        Where a log is doubted it is of what is believed, times the doubt: as if it had been the shorter by as much.
        """
        precision = np.eye(self.size)
        np.fill_diagonal(precision[: self.corrections.size, : self.corrections.size], self.spread**-2)
        precision[: self.believed] *= self.doubt
        if len(self.loaded):
            common = self.corrections.inertial_parameters.size + self.loaded
            precision[np.ix_(common, common)] += 1 / (len(common) * SUM_OF_GAINS) ** 2
        return precision

    def values(self, coordinates: Array) -> tuple[Array, Array]:
        """Return x, shape (c,), and the bodies' derivatives, shape (L, 10, 10); the others' are `scales`."""
        inertial = self.corrections.inertial_parameters.size
        changes, slopes = self.bodies.corrections(coordinates[:inertial].reshape(-1, SIZE))
        return np.concatenate([changes.ravel(), self.scales * coordinates[inertial:]]), slopes

    @property
    def scales(self) -> Array:
        """Units of the coordinates of calibration and repeated errors."""
        c = self.corrections
        sensors = np.repeat([GAIN, ZERO, TILT], [c.gains, c.zeros, c.tilts])
        wrenches = np.tile(np.repeat([FORCE, MOMENT, WRENCH_GAIN], [3, 3, 1]), c.wrenches)
        calibration = np.concatenate([sensors, wrenches, np.full(len(c.rotors), ROTOR)])
        calibration[np.setdiff1d(np.arange(c.gains), self.loaded)] = 0.0
        return np.concatenate([calibration, np.tile(self.repeated, self.gaits * COSINES)])


def model_corrections(corrections: Corrections, loads: Array) -> ModelCorrections:
    """Return the coordinates of what there is to correct, without repeated errors.

    `loads` are the torques that the sensors see, root mean square [N m], shape (gains,). The gains of those that carry
    next to nothing are left alone: they cannot be told from friction, and noise would be taken for them.
    """
    loaded = np.flatnonzero(loads > LEAST_LOAD * loads.max(initial=0.0))
    bodies = bodies_of(corrections.inertial_parameters)
    return ModelCorrections(corrections, bodies, loaded, 0, np.zeros(0), np.ones(corrections.size))
