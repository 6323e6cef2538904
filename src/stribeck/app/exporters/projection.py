"""The most probable friction and inertias of a result among those that a robot model can represent.

A model has no torque offsets. The offset of a sensor is not part of the robot. Commands have no sensor: their offsets
are errors of the model, for example of a center of mass. Friction and inertias are then conditioned on zero offsets.
Inertias are written if they lower the torque error of held-out parts of the logs.
"""

from dataclasses import replace

import numpy as np

from stribeck.app.exporters.moved import moved
from stribeck.core.result import Result
from stribeck.core.robot import Robot


def inertias_pay(result: Result) -> tuple[bool, str]:
    """Check whether estimated inertias lower the held-out torque error by 2 % or more, by one standard error.

    With exact models they lower it by up to 1 %. The clause states their effect.
    """
    change = result.corrections and result.corrections.held_out_change
    if not change:
        return False, "their effect on the torque error is unknown"
    mean, error = change
    about = f"the estimates change the held-out torque error by {100 * np.expm1(mean):+.0f} % (± {100 * error:.0f} %)"
    return bool(mean + error < np.log(1 - 0.02)), about


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
    mode = moved(result, result.posterior.shifts(offsets))
    exact = {name: joint.with_values({"offset": 0.0}) for name, joint in mode.joints.items() if not joint.torque_unit}
    return replace(mode, joints={**mode.joints, **exact})
