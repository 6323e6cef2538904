"""Places in the parameter vector: no other file computes an offset."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stribeck.robot.inertial_parameters import SIZE
from stribeck.whole_log.weak_equations import WRENCH_SIZE, CorrectionLayout


@dataclass(frozen=True, kw_only=True)
class ModelLayout:
    """Named slices of a vector: friction joint by joint, corrections of the model, random effects, alternative terms.

    The order is the same for coordinates, with p parameters `per_joint`, for values, with R coefficients of a joint's
    friction curve, and for corrections by themselves, with none.

    Attributes
    ----------
    joints, per_joint
        Number n of joints, and of entries of each.
    bodies, gains, zeros, tilts, delays, wrenches, rotors, log_offsets
        How many there are of each, as in `CorrectionLayout`.
    gaits, gait_effects
        Number of gait phases, and of the random effects of each.
    alternatives
        Number of columns of alternative terms.
    """

    joints: int = 0
    per_joint: int = 0
    bodies: int = 0
    gains: int = 0
    zeros: int = 0
    tilts: int = 0
    delays: int = 0
    wrenches: int = 0
    rotors: int = 0
    log_offsets: int = 0
    gaits: int = 0
    gait_effects: int = 0
    alternatives: int = 0

    def part(self, first: str, last: str | None = None) -> slice:
        """Return the slice from one part to another, both included, by their names."""
        sizes = {
            "friction": self.joints * self.per_joint,
            "bodies": SIZE * self.bodies,
            "gains": self.gains,
            "zeros": self.zeros,
            "tilts": self.tilts,
            "delays": self.delays,
            "wrenches": WRENCH_SIZE * self.wrenches,
            "rotors": self.rotors,
            "log_offsets": self.log_offsets,
            "random_effects": self.gaits * self.gait_effects,
            "alternatives": self.alternatives,
        }
        names, ends = list(sizes), np.cumsum([0, *sizes.values()]).tolist()
        return slice(ends[names.index(first)], ends[names.index(last or first) + 1])

    @property
    def friction(self) -> slice:
        """All joints."""
        return self.part("friction")

    @property
    def corrections(self) -> slice:
        """All that corrects the model."""
        return self.part("bodies", "log_offsets")

    @property
    def nearly_right(self) -> slice:
        """Corrections whose priors are widened: bodies and sensors, but no wrenches, rotors and offsets."""
        return self.part("bodies", "delays")

    @property
    def model(self) -> slice:
        """All corrections and random effects."""
        return self.part("bodies", "random_effects")

    @property
    def size(self) -> int:
        """Of the whole vector."""
        return int(self.part("alternatives").stop)

    def joint(self, joint: int) -> slice:
        """Return one joint's entries."""
        return slice(joint * self.per_joint, (joint + 1) * self.per_joint)

    def each_joint(self, entry: int, joints: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the places of one entry of some joints."""
        return joints * self.per_joint + entry

    def rotor(self, number: int) -> int:
        """Return the place of a rotor inertia by its number among them."""
        return int(self.part("rotors").start) + number

    def gait(self, number: int) -> slice:
        """Return the random effects of one gait phase."""
        first = int(self.part("random_effects").start) + number * self.gait_effects
        return slice(first, first + self.gait_effects)

    def body_groups(self) -> tuple[NDArray[np.int64], ...]:
        """Return the places of all bodies' masses, centres of mass and second moments."""
        places = np.arange(self.size)[self.part("bodies")].reshape(-1, SIZE)
        return places[:, 0], places[:, 1:4].ravel(), places[:, 4:].ravel()

    def without(self, *names: str) -> ModelLayout:
        """Return the layout with none of some fields."""
        return replace(self, **dict.fromkeys(names, 0))

    def beside(self, joints: int, per_joint: int) -> ModelLayout:
        """Return the layout of the same corrections beside the friction of some joints."""
        return replace(self, joints=joints, per_joint=per_joint)


def layout_of(corrections: CorrectionLayout) -> ModelLayout:
    """Return the layout of corrections by themselves."""
    return ModelLayout(
        bodies=len(corrections.inertial_parameters),
        gains=corrections.gains,
        zeros=corrections.zeros,
        tilts=corrections.tilts,
        delays=corrections.delays,
        wrenches=corrections.wrenches,
        rotors=len(corrections.rotors),
        log_offsets=math.prod(corrections.log_offsets),
    )
