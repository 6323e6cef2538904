"""Correction of robot and logs by the errors that the whole-log method estimates."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from stribeck.base.typing import Array
from stribeck.log import RobotLog
from stribeck.log.interpolation import linear, slerp
from stribeck.log.storage import allocate
from stribeck.robot import Robot
from stribeck.robot.inertial_parameters import SIZE
from stribeck.robot.rooting import BASE_FRAME
from stribeck.whole_log.model.corrections import Layout
from stribeck.whole_log.weak_equations import CorrectionLayout


def corrected_robot(robot: Robot, corrections: CorrectionLayout, values: Array) -> Robot:
    """Replace the inertias of the robot's bodies by the estimates."""
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
    log: RobotLog,
    number: int | None,
    robot: Robot,
    columns: NDArray[np.int64],
    corrections: CorrectionLayout,
    values: Array,
    delay: float,
) -> RobotLog:
    """Correct gains, zeros, offsets and orientation of a log by the estimates.

    Torques are shifted by `delay` [s]. The offset of the log minus the mean over all logs is subtracted. A log that
    was not fitted has no number and keeps its offsets.
    """
    layout = Layout(corrections)
    gains, zeros, tilt, delays = (values[layout.part(part)] for part in ("gains", "zeros", "tilts", "delays"))
    late = abs(delay) > 0.1 * (log.time[1] - log.time[0])  # otherwise the log is unchanged
    torque = linear(log.time + delay, log.time, log.torque) if late else log.torque
    if corrections.log_effects[0] and number is not None:
        torque = torque.copy()
        torque[:, columns] -= corrections.effects_of_logs(values[layout.part("log_effects")])[0, number]
    if not corrections.gains:
        return replace(log, torque=torque)
    factors = np.ones(log.torque.shape[1])
    factors[columns] -= gains
    scaled, position = allocate(torque.shape), allocate(log.position.shape)
    np.multiply(torque, factors, out=scaled)
    np.subtract(log.position, zeros, out=position)
    orientation = log.base_orientation
    if orientation is not None and robot.base_frame == BASE_FRAME:
        orientation = slerp(log.time + delays[1:].sum(), log.time, orientation)
        orientation = (Rotation.from_quat(orientation) * Rotation.from_rotvec(-tilt)).as_quat()
    return replace(log, torque=scaled, position=position, base_orientation=orientation)
