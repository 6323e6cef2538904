"""Known friction, shown next to the result."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from stribeck.core.base.typing import Array


@dataclass(frozen=True, eq=False, kw_only=True)
class Reference:
    """Known friction: ground truth of a simulation, or a measurement on a test bench.

    Attributes
    ----------
    name
        Label in the legend; its last word is the label of numbers.
    curves
        Velocity [rad/s] and friction torque [N m] by joint, shape (K,) each.
    parameters
        Values by joint and parameter, for parameters of the fitted law.
    """

    name: str
    curves: Mapping[str, tuple[Array, Array]] = field(default_factory=dict)
    parameters: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def without_offset(self, joint: str) -> tuple[Array, Array] | None:
        """Compute a joint's curve without its offset, the torque at rest; None if the curve does not include rest."""
        velocity, torque = self.curves.get(joint, (np.empty(0), np.empty(0)))
        if not len(velocity) or not velocity[0] <= 0 <= velocity[-1]:
            return None
        return velocity, torque - np.interp(0.0, velocity, torque)


NO_REFERENCE = Reference(name="none")
