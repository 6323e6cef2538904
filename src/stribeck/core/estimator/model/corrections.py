"""Corrections of model and calibration in units of their prior standard deviations, with learned priors.

The table in docs/estimator.md, "Corrections", has the priors.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.equations.constants import WIDEST_PRIOR
from stribeck.core.equations.whole_log.corrections import CORRECTIONS
from stribeck.core.equations.whole_log.corrections.correction import Layout
from stribeck.core.estimator.model.bodies import Bodies, bodies_of
from stribeck.core.robot.inertial_parameters import SIZE
from stribeck.core.settings import Priors

HELD = 1e-4
"""Prior standard deviation of a coordinate that is held at its prior mean [1]."""

CARRIER = 8.0
"""First prior of a floating base's body relative to other bodies' [1], because bases carry computers and payloads."""

FLOOR = 1e-5
"""Weight of the first prior of model and sensors, as a number of coordinates [1].

With 1e-3, equal offsets differ between logs by 2 % of their first prior, and curves are up to 9 % further off."""


@dataclass(frozen=True, eq=False)
class Slopes:
    """Derivatives T of corrections by their coordinates: blocks for bodies, shape (L, 10, 10), then a diagonal."""

    bodies: Array
    others: Array

    def __len__(self) -> int:
        """Return the number of corrections."""
        return len(self.bodies) * SIZE + len(self.others)

    def pulled(self, rows: Array) -> Array:
        """Multiply rows by T^T, shape (c, k)."""
        return self._times(self.bodies.transpose(0, 2, 1), rows)

    def pushed(self, rows: Array) -> Array:
        """Multiply rows by T, shape (c, k)."""
        return self._times(self.bodies, rows)

    def _times(self, bodies: Array, rows: Array) -> Array:
        of_bodies, others = np.split(rows, [len(bodies) * SIZE])
        product = bodies @ of_bodies.reshape(len(bodies), SIZE, rows.shape[1])
        return np.concatenate([product.reshape(of_bodies.shape), self.others[:, None] * others])


@dataclass(frozen=True, eq=False)
class ModelCorrections:
    """Corrections, one per column of the regressors, as functions of c coordinates in units of their prior.

    Attributes
    ----------
    layout
        Layout of the corrections without friction.
    bodies
        Bodies of the model, the mean of the inertias' prior.
    loaded
        Indices of torque sensors with corrected gains; the mean of these gains is one.
    prior_mean, prior_std
        Mean and standard deviation of the coordinates' prior [1], shape (c,).
    priors
        Units of the coordinates.
    torque
        Torque of the joints, the scale of offsets [N m].
    overdispersion
        Overdispersion of the coordinates of model and sensors [1], equation (27).
    largest
        Largest standard deviation of the prior of bodies that a log may choose [1].
    """

    layout: Layout
    bodies: Bodies
    loaded: IntArray
    prior_mean: Array
    prior_std: Array
    priors: Priors
    torque: float
    overdispersion: float = 1.0
    largest: float = 1.0

    @property
    def nearly_right(self) -> slice:
        """Corrections with widened priors: bodies and sensors, except wrenches, rotors and offsets."""
        return self.layout.part("bodies", "base_delay")

    @property
    def common_gain(self) -> float:
        """Standard deviation of the mean gain [1], which logs cannot determine."""
        deviations = self.prior_std[self.layout.part("gains")][self.loaded]
        return self.priors.torque_gain * float(np.linalg.norm(deviations)) / max(len(self.loaded), 1)

    @property
    def precision(self) -> Array:
        """Inverse covariance of the prior of the coordinates, shape (c, c).

        The overdispersion multiplies the precision of model and sensors, which has the effect of a shorter log. The
        mean gain stays at one, within a thousandth of its prior, because a common gain scales all friction.
        """
        diagonal = self.prior_std**-2
        diagonal[self.nearly_right] *= self.overdispersion
        precision = np.diag(diagonal)
        if len(self.loaded):
            gains = self.layout.places("gains")[self.loaded]
            precision[np.ix_(gains, gains)] += 1 / (len(gains) * 1e-3) ** 2
        return precision

    def values(self, coordinates: Array) -> Array:
        """Compute the corrections, shape (c,)."""
        bodies = self.layout.part("bodies")
        changes = self.bodies.corrections(coordinates[bodies].reshape(-1, SIZE))
        return np.concatenate([changes.ravel(), self.scales * coordinates[bodies.stop :]])

    def slopes(self, coordinates: Array) -> Slopes:
        """Compute the derivatives of the corrections by the coordinates."""
        return Slopes(self.bodies.slopes(coordinates[self.layout.part("bodies")].reshape(-1, SIZE)), self.scales)

    @cached_property
    def scales(self) -> Array:
        """Units of the coordinates of all corrections but bodies."""
        c = self.layout
        units = {
            kind.name: np.full(c.sizes[kind.name], kind.scales(self.priors, c)) for kind in CORRECTIONS if kind.scales
        }
        units["gains"][np.setdiff1d(np.arange(len(units["gains"])), self.loaded)] = 0.0
        units["log_effects"] = self.priors.log_offset * self.torque * units["log_effects"]
        return np.concatenate(list(units.values()))

    def _groups(self) -> Iterator[tuple[IntArray, float]]:
        """Yield groups of coordinates that share a prior standard deviation, and its largest value [1].

        The groups are masses, centers, moments, grouped corrections, and the contrasts of each effect of a joint. A
        floating base has no group, because its load says nothing about the errors of other bodies.
        """
        bodies = self.layout.places("bodies").reshape(-1, SIZE)[int(self.layout.floating) :]
        contrasts = self.layout.places("log_effects").reshape(self.layout.log_effects[0] or 1, -1).T
        groups = [(group, self.largest) for group in (bodies[:, 0], bodies[:, 1:4].ravel(), bodies[:, 4:].ravel())]
        groups += [(self.layout.places(correction.name), 1.0) for correction in CORRECTIONS if correction.grouped]
        groups += [(group, np.inf) for group in contrasts]
        yield from (pair for pair in groups if len(pair[0]) and not np.all(self.prior_std[pair[0]] == HELD))

    def learned(self, coordinates: Array, variance: Array) -> ModelCorrections:
        """Learn the prior of model and sensors, equation (23), from the coordinates of a fit and their variances.

        The prior is at most `largest` times its initial value for bodies, and at most its initial value for sensors.
        Otherwise bodies and sensors would explain errors of other kinds, more in every round.
        """
        prior_std, dispersion = self.prior_std.copy(), np.ones(len(self.prior_std))
        dispersion[self.nearly_right] = self.overdispersion
        for group, largest in self._groups():
            known = (1 - dispersion[group] * variance[group] / prior_std[group] ** 2).clip(0, 1).sum()
            squares = np.sum((coordinates[group] - self.prior_mean[group]) ** 2)
            prior_std[group] = min(np.sqrt((squares + FLOOR) / (known + FLOOR)), largest)
        return replace(self, prior_std=prior_std)

    @property
    def widest(self) -> ModelCorrections:
        """The same corrections with the widest priors of bodies."""
        deviation = self.prior_std.copy()
        bodies = self.layout.part("bodies")
        deviation[bodies] = np.maximum(deviation[bodies], WIDEST_PRIOR)
        return replace(self, prior_std=deviation, largest=WIDEST_PRIOR)

    @property
    def with_equal_logs(self) -> ModelCorrections:
        """Corrections with equal friction in all logs; offsets may differ."""
        contrasts, effects, joints = self.layout.log_effects
        places = self.layout.places("log_effects").reshape(contrasts, effects, joints)
        return self.held(places[:, 1:].ravel(), 0.0)

    @property
    def without_delay(self) -> ModelCorrections:
        """The same corrections without a delay of the torques."""
        return self.held(self.layout.places("torque_delay"), 0.0)

    def held(self, places: IntArray, values: Array | float) -> ModelCorrections:
        """Hold coordinates at values."""
        mean, deviation = self.prior_mean.copy(), self.prior_std.copy()
        mean[places], deviation[places] = values, HELD
        return replace(self, prior_mean=mean, prior_std=deviation)

    def with_possible_rotors(self, coordinates: Array) -> ModelCorrections:
        """Hold rotor inertias at zero that are negative at some coordinates; return the object itself without any."""
        rotors = self.layout.places("rotors")
        zero = -self.layout.armature / self.scales[rotors - self.layout.part("bodies").stop]
        negative = (coordinates[rotors] < zero) & (self.prior_std[rotors] > HELD)
        return self.held(rotors[negative], zero[negative]) if negative.any() else self

    def late(self, delay: float) -> ModelCorrections:
        """Adapt the prior to equations whose torques are shifted by a delay [s]: it refers to the total delay.

        If the estimated delay is larger than its prior, the estimate determines the prior.
        """
        mean, deviation, places = self.prior_mean.copy(), self.prior_std.copy(), self.layout.places("torque_delay")
        mean[places] = -delay / self.priors.torque_delay
        deviation[places] = np.maximum(1.0, np.abs(mean[places]))
        return replace(self, prior_mean=mean, prior_std=deviation)


def model_corrections(layout: Layout, loads: Array, priors: Priors, torque: float) -> ModelCorrections:
    """Build the coordinates of corrections.

    `loads` are the sensors' torques, root mean square [N m], shape (gains,). Gains of sensors with less than a
    twentieth of the largest load are not corrected, because friction and noise would look like gain errors.
    `torque` is the torque of the joints [N m].
    """
    loaded = np.flatnonzero(loads > 0.05 * loads.max(initial=0.0))
    bodies = bodies_of(layout.inertial_parameters, priors)
    prior_std = np.ones(layout.size)
    prior_std[: SIZE * layout.floating] = CARRIER
    return ModelCorrections(layout, bodies, loaded, np.zeros(layout.size), prior_std, priors, torque)
