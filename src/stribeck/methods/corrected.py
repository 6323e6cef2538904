"""Robot and logs without the errors that the whole log has shown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from stribeck.inertial_parameters import SIZE
from stribeck.log import RobotLog
from stribeck.log.storage import allocate
from stribeck.robot import Robot
from stribeck.robot.rooting import BASE_FRAME
from stribeck.typing import Array
from stribeck.weak_equations import Corrections


def corrected_robot(robot: Robot, corrections: Corrections, values: Array) -> Robot:
    """Return the robot whose bodies have the inertias that were found."""
    bodies = len(corrections.bodies)
    if not bodies:
        return robot
    parameters = corrections.inertial_parameters + values[: SIZE * bodies].reshape(bodies, SIZE)
    model = pin.Model(robot.tree.model)
    for body, found in enumerate(parameters, start=1):
        if found[0] > 0:
            model.inertias[body] = pin.Inertia.FromDynamicParameters(found)
    return replace(robot, tree=replace(robot.tree, model=model))


def corrected_log(
    log: RobotLog, robot: Robot, columns: NDArray[np.int64], corrections: Corrections, values: Array
) -> RobotLog:
    """Return the log without the errors of gains, zeros and orientation that were found."""
    if not corrections.gains:
        return log
    ends = np.cumsum([corrections.inertial_parameters.size, corrections.gains, corrections.zeros, corrections.tilts])
    _, gains, zeros, tilt, _ = np.split(values, ends)
    factors = np.ones(log.torque.shape[1])
    factors[columns] -= gains
    torque, position = allocate(log.torque.shape), allocate(log.position.shape)
    np.multiply(log.torque, factors, out=torque)
    np.subtract(log.position, zeros, out=position)
    orientation = log.base_orientation
    if orientation is not None and robot.base_frame == BASE_FRAME:
        orientation = (Rotation.from_quat(orientation) * Rotation.from_rotvec(-tilt)).as_quat()
    return replace(log, torque=torque, position=position, base_orientation=orientation)
