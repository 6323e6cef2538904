"""Corrections of model and calibration, and random effects, in units of their prior standard deviations.

The priors are those of the table in docs/estimator.md, "Coordinates and priors".
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.robot.inertial_parameters import SIZE
from stribeck.settings import Priors
from stribeck.whole_log.constants import LEAST_LOAD, MEAN_GAIN_STD
from stribeck.whole_log.model.bodies import Bodies, bodies_of
from stribeck.whole_log.model.friction_curves import FIXED
from stribeck.whole_log.model.layout import ModelLayout, layout_of
from stribeck.whole_log.weak_equations import CorrectionLayout


@dataclass(frozen=True, eq=False)
class ModelCorrections:
    """Corrections x, one a column of the regressors, as functions of c coordinates in units of their prior.

    Attributes
    ----------
    corrections
        Corrections of the weak form.
    bodies
        Of the model: mean of the prior of the inertias.
    loaded
        Which torque sensors have gains that are corrected; the mean of these gains is one.
    layout
        Of their coordinates, and of those of random effects, whose standard deviation is one.
    prior_std
        Prior standard deviations of the coordinates of `corrections` [1], shape (corrections.size,).
    priors
        Units of the coordinates.
    torque
        Of the joints, which offsets are in proportion to [N m].
    overdispersion
        Of the model's coordinates [1], equation (27).
    """

    corrections: CorrectionLayout
    bodies: Bodies
    loaded: NDArray[np.int64]
    layout: ModelLayout
    prior_std: Array
    priors: Priors
    torque: float
    overdispersion: float = 1.0

    @property
    def size(self) -> int:
        """Number of coordinates c."""
        return self.layout.size

    @property
    def common_gain(self) -> float:
        """Standard deviation of the mean gain [1], which no log determines."""
        own = self.prior_std[self.layout.part("gains")][self.loaded]
        return self.priors.torque_gain * float(np.linalg.norm(own)) / max(len(self.loaded), 1)

    @property
    def precision(self) -> Array:
        """Inverse covariance of the prior of the coordinates, shape (c, c).

        That of model and sensors is multiplied by the overdispersion: as if the log were the shorter by as much.
        """
        diagonal = np.ones(self.size)
        diagonal[self.layout.corrections] = self.prior_std**-2
        diagonal[self.layout.nearly_right] *= self.overdispersion
        precision = np.diag(diagonal)
        if len(self.loaded):
            gains = np.arange(self.size)[self.layout.part("gains")][self.loaded]
            precision[np.ix_(gains, gains)] += 1 / (len(gains) * MEAN_GAIN_STD) ** 2
        return precision

    def values(self, coordinates: Array) -> Array:
        """Return x, shape (c,)."""
        bodies = self.layout.part("bodies")
        changes = self.bodies.corrections(coordinates[bodies].reshape(-1, SIZE))
        return np.concatenate([changes.ravel(), self.scales * coordinates[bodies.stop :]])

    def body_slopes(self, coordinates: Array) -> Array:
        """Return the derivatives of x of the bodies, shape (L, 10, 10); the others' are `scales`."""
        return self.bodies.slopes(coordinates[self.layout.part("bodies")].reshape(-1, SIZE))

    def with_log_offsets(self, differ: NDArray[np.bool_]) -> ModelCorrections:
        """Return the coordinates with the same offsets in all logs but for joints where they `differ`, shape (n,)."""
        prior_std = self.prior_std.copy()
        prior_std[self.layout.part("log_offsets")] = np.tile(
            np.where(differ, 1.0, FIXED), self.corrections.log_offsets[0]
        )
        return replace(self, prior_std=prior_std)

    @cached_property
    def scales(self) -> Array:
        """Units of the coordinates of calibration and random effects."""
        c, priors = self.corrections, self.priors
        sensors = np.repeat(
            [priors.torque_gain, priors.encoder_zero, priors.imu_tilt, priors.torque_delay, priors.base_delay],
            [c.gains, c.zeros, c.tilts, c.delays > 0, c.delays > 1],
        )
        wrench = np.repeat([priors.wrench_force, priors.wrench_moment, priors.wrench_gain], [3, 3, 1])
        rotors = np.where(c.armature > 0, priors.rotor_share * c.armature, priors.rotor)
        offsets = np.full(self.layout.log_offsets, priors.log_offset * self.torque)
        calibration = np.concatenate([sensors, np.tile(wrench, c.wrenches), rotors, offsets])
        calibration[np.setdiff1d(np.arange(c.gains), self.loaded)] = 0.0
        return np.concatenate([calibration, np.ones(self.size - self.corrections.size)])


def model_corrections(
    corrections: CorrectionLayout, loads: Array, priors: Priors, torque: float = 1.0
) -> ModelCorrections:
    """Return the coordinates of corrections, without random effects.

    `loads` are the torques that the sensors see, root mean square [N m], shape (gains,). The gains of those that carry
    next to nothing are not corrected: friction and noise would be taken for them. `torque` is that of the joints [N m].
    """
    loaded = np.flatnonzero(loads > LEAST_LOAD * loads.max(initial=0.0))
    bodies = bodies_of(corrections.inertial_parameters, priors)
    layout, prior_std = layout_of(corrections), np.ones(corrections.size)
    return ModelCorrections(corrections, bodies, loaded, layout, prior_std, priors, torque)
