"""Corrections of model and calibration in units of their prior standard deviations, and their places in vectors.

The table in docs/estimator.md, "Corrections", has the priors.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.robot.inertial_parameters import SIZE
from stribeck.settings import Priors
from stribeck.whole_log.model.bodies import Bodies, bodies_of
from stribeck.whole_log.weak_equations import WRENCH_SIZE, CorrectionLayout

CONSIDERED = 1e-2
"""Prior of an error that is considered but not estimated, over its standard error [1] (Schmidt 1966).

Small enough that the log does not move it; `covariance_budget` restores its effect.
"""


@dataclass(frozen=True, eq=False)
class Layout:
    """Named slices of a vector: no other file computes an offset.

    Friction comes first, joint by joint with `per_joint` entries each, then the corrections. The order is the same for
    coordinates and for the values that a log is linear in.
    """

    corrections: CorrectionLayout
    joints: int = 0
    per_joint: int = 0

    @cached_property
    def _ends(self) -> dict[str, tuple[int, int]]:
        c = self.corrections
        sizes = {
            "friction": self.joints * self.per_joint,
            "bodies": c.inertial_parameters.size,
            "gains": c.gains,
            "zeros": c.zeros,
            "tilts": c.tilts,
            "delays": c.delays,
            "command_delays": len(c.command_delays),
            "wrenches": WRENCH_SIZE * c.wrenches,
            "rotors": len(c.rotors),
            "log_offsets": math.prod(c.log_offsets),
        }
        ends = np.cumsum([0, *sizes.values()]).tolist()
        return {name: (ends[k], ends[k + 1]) for k, name in enumerate(sizes)}

    def part(self, first: str, last: str | None = None) -> slice:
        """Return the slice from one part to another, both included, by their names."""
        return slice(self._ends[first][0], self._ends[last or first][1])

    def places(self, first: str, last: str | None = None) -> NDArray[np.int64]:
        """Return the same as numbers."""
        return np.arange(self.size)[self.part(first, last)]

    @property
    def size(self) -> int:
        """Length of the whole vector."""
        return self._ends["log_offsets"][1]

    def joint(self, joint: int) -> slice:
        """Return one joint's entries."""
        return slice(joint * self.per_joint, (joint + 1) * self.per_joint)


@dataclass(frozen=True, eq=False)
class Slopes:
    """Derivatives T of corrections by their coordinates: blocks of bodies, shape (L, 10, 10), then a diagonal."""

    bodies: Array
    others: Array

    def pulled(self, rows: Array) -> Array:
        """Return T^T times rows, shape (c, k)."""
        return self._times(self.bodies.transpose(0, 2, 1), rows)

    def pushed(self, rows: Array) -> Array:
        """Return T times rows, shape (c, k)."""
        return self._times(self.bodies, rows)

    def _times(self, bodies: Array, rows: Array) -> Array:
        of_bodies, others = np.split(rows, [len(bodies) * SIZE])
        own = bodies @ of_bodies.reshape(len(bodies), SIZE, rows.shape[1])
        return np.concatenate([own.reshape(of_bodies.shape), self.others[:, None] * others])


@dataclass(frozen=True, eq=False)
class ModelCorrections:
    """Corrections, one a column of the regressors, as functions of c coordinates in units of their prior.

    Attributes
    ----------
    layout
        Of the corrections by themselves.
    bodies
        Of the model: mean of the prior of the inertias.
    loaded
        Which torque sensors have gains that are corrected; the mean of these gains is one.
    prior_mean, prior_std
        Of the coordinates [1], shape (c,).
    priors
        Units of the coordinates.
    torque
        Of the joints, which offsets are in proportion to [N m].
    overdispersion
        Of the coordinates of model and sensors [1], equation (27).
    """

    layout: Layout
    bodies: Bodies
    loaded: NDArray[np.int64]
    prior_mean: Array
    prior_std: Array
    priors: Priors
    torque: float
    overdispersion: float = 1.0

    @property
    def corrections(self) -> CorrectionLayout:
        """Layout of the corrections."""
        return self.layout.corrections

    @property
    def nearly_right(self) -> slice:
        """Corrections whose priors are widened: bodies and sensors, but no wrenches, rotors and offsets."""
        return self.layout.part("bodies", "delays")

    @property
    def common_gain(self) -> float:
        """Standard deviation of the mean gain [1], which no log determines."""
        own = self.prior_std[self.layout.part("gains")][self.loaded]
        return self.priors.torque_gain * float(np.linalg.norm(own)) / max(len(self.loaded), 1)

    @property
    def precision(self) -> Array:
        """Inverse covariance of the prior of the coordinates, shape (c, c).

        That of model and sensors is multiplied by the overdispersion: as if the log were the shorter by as much. The
        mean gain is held at one, within a thousandth of its prior, as a common gain is friction's scale.
        """
        diagonal = self.prior_std**-2
        diagonal[self.nearly_right] *= self.overdispersion
        precision = np.diag(diagonal)
        if len(self.loaded):
            gains = self.layout.places("gains")[self.loaded]
            precision[np.ix_(gains, gains)] += 1 / (len(gains) * 1e-3) ** 2
        return precision

    def values(self, coordinates: Array) -> Array:
        """Return the corrections, shape (c,)."""
        bodies = self.layout.part("bodies")
        changes = self.bodies.corrections(coordinates[bodies].reshape(-1, SIZE))
        return np.concatenate([changes.ravel(), self.scales * coordinates[bodies.stop :]])

    def slopes(self, coordinates: Array) -> Slopes:
        """Return the derivatives of the corrections by the coordinates."""
        return Slopes(self.bodies.slopes(coordinates[self.layout.part("bodies")].reshape(-1, SIZE)), self.scales)

    @cached_property
    def scales(self) -> Array:
        """Units of the coordinates of all corrections but bodies."""
        c, priors = self.corrections, self.priors
        sensors = np.repeat(
            [priors.torque_gain, priors.encoder_zero, priors.imu_tilt, priors.torque_delay, priors.base_delay],
            [c.gains, c.zeros, c.tilts, c.delays > 0, c.delays > 1],
        )
        sensors[np.setdiff1d(np.arange(c.gains), self.loaded)] = 0.0
        late = CONSIDERED * np.array(c.command_delays)
        wrench = np.repeat([priors.wrench_force, priors.wrench_moment, priors.wrench_gain], [3, 3, 1])
        rotors = np.where(c.armature > 0, priors.rotor_share * c.armature, priors.rotor)
        offsets = np.full(math.prod(c.log_offsets), priors.log_offset * self.torque)
        return np.concatenate([sensors, late, np.tile(wrench, c.wrenches), rotors, offsets])

    def groups(self) -> Iterator[NDArray[np.int64]]:
        """Yield the coordinates that have one prior standard deviation.

        Masses, centres, moments, gains, zeros, tilts, and the contrasts of each joint's offsets between logs.
        """
        bodies = self.layout.places("bodies").reshape(-1, SIZE)
        calibration = [self.layout.places(name) for name in ("gains", "zeros", "tilts")]
        offsets = self.layout.places("log_offsets").reshape(self.corrections.log_offsets).T
        groups = (bodies[:, 0], bodies[:, 1:4].ravel(), bodies[:, 4:].ravel(), *calibration, *offsets)
        yield from (group for group in groups if len(group))

    def late(self, delay: float) -> ModelCorrections:
        """Return the coordinates for equations whose torques are taken a delay later [s]: the prior is of all of it.

        A delay that the log shows, and that is larger than its prior, tells itself how late torques may be.
        """
        mean, deviation, own = self.prior_mean.copy(), self.prior_std.copy(), self.layout.places("delays")[:1]
        mean[own] = -delay / self.priors.torque_delay
        deviation[own] = np.maximum(1.0, np.abs(mean[own]))
        return replace(self, prior_mean=mean, prior_std=deviation)


def model_corrections(corrections: CorrectionLayout, loads: Array, priors: Priors, torque: float) -> ModelCorrections:
    """Build the coordinates of corrections.

    `loads` are the torques that the sensors see, root mean square [N m], shape (gains,). Gains of sensors that see less
    than a twentieth of the largest load are not corrected, because friction and noise would pass as gain errors.
    `torque` is the torque of the joints [N m].
    """
    loaded = np.flatnonzero(loads > 0.05 * loads.max(initial=0.0))
    bodies, size = bodies_of(corrections.inertial_parameters, priors), corrections.size
    return ModelCorrections(Layout(corrections), bodies, loaded, np.zeros(size), np.ones(size), priors, torque)
