"""The most probable friction and inertias of a result among those that a robot model can represent.

A model has no torque offsets. The offset of a sensor is not part of the robot. Commands have no sensor: their offsets
are errors of the model, for example of a center of mass. Friction and inertias are then conditioned on zero offsets.
Inertias are written if they lower the torque error of held-out parts of the logs.
"""

from dataclasses import dataclass, replace

import numpy as np

from stribeck.exporters.moved import moved
from stribeck.result import Result
from stribeck.robot import Robot


@dataclass(frozen=True, kw_only=True)
class HeldOutChange:
    """Change of the held-out torque error by estimated inertias, mean over joints, and its standard error [1].

    Values are logarithms of ratios; NaN if nothing was held out.
    """

    mean: float
    error: float

    @property
    def pays(self) -> bool:
        """Whether the error falls by 2 % or more, by one standard error; with exact models it falls by up to 1 %."""
        return bool(self.mean + self.error < np.log(1 - 0.02))

    def __str__(self) -> str:
        if not np.isfinite(self.mean):
            return "their effect on the torque error is unknown"
        change = 100 * np.expm1(self.mean)
        return f"the estimates change the held-out torque error by {change:+.0f} % (± {100 * self.error:.0f} %)"


def held_out_change(result: Result) -> HeldOutChange:
    """Compare the held-out torque errors with estimated and with given inertias, by joint."""
    pairs = [joint.torque_r2 for joint in result.joints.values() if joint.torque_r2]
    ratios = [(1 - own.corrected) / (1 - own.nominal) for own in pairs if own.corrected is not None and own.nominal < 1]
    if len(ratios) < 2:
        return HeldOutChange(mean=float("nan"), error=float("nan"))
    halves = np.log(np.maximum(ratios, 1e-12)) / 2
    return HeldOutChange(mean=float(halves.mean()), error=float(halves.std(ddof=1) / len(halves) ** 0.5))


def projected(result: Result, robot: Robot) -> Result:
    """Set the offsets of commanded torques to zero, and friction, rotors and inertias to the most probable values."""
    if robot.torque_source != "command":
        return result
    offsets = {
        f"{name}.offset": 0.0
        for name, joint in result.joints.items()
        if "offset" in joint.parameters and joint.torque_unit is None
    }
    if not offsets:
        return result
    found = moved(result, result.posterior.shifts(offsets))
    exact = {name: joint.with_values({"offset": 0.0}) for name, joint in found.joints.items() if not joint.torque_unit}
    return replace(found, joints={**found.joints, **exact})
