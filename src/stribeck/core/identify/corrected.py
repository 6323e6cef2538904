"""Correction of robot and logs by the errors that the whole-log method estimates."""

from dataclasses import replace

import pinocchio as pin

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.equations.whole_log.corrections import CORRECTIONS
from stribeck.core.equations.whole_log.corrections.correction import Layout
from stribeck.core.equations.whole_log.corrections.model import effects_of_logs
from stribeck.core.estimator.estimate import WholeLogFit
from stribeck.core.log import RobotLog
from stribeck.core.log.interpolation import linear
from stribeck.core.robot import Robot
from stribeck.core.robot.inertial_parameters import SIZE


def corrected_robot(robot: Robot, layout: Layout, values: Array) -> Robot:
    """Replace the inertias of the robot's bodies by the estimates."""
    bodies = len(layout.bodies)
    if not bodies:
        return robot
    parameters = layout.inertial_parameters + values[: SIZE * bodies].reshape(bodies, SIZE)
    model = pin.Model(robot.tree.model)
    for body, inertia in enumerate(parameters, start=1):
        if inertia[0] > 0:
            model.inertias[body] = pin.Inertia.FromDynamicParameters(inertia)
    return replace(robot, tree=replace(robot.tree, model=model))


def corrected_log(log: RobotLog, number: int | None, robot: Robot, columns: IntArray, whole: WholeLogFit) -> RobotLog:
    """Correct gains, zeros, offsets and orientation of a log, and the delay of its torques, by the estimates.

    The offset of the log minus the mean over all logs is subtracted. A log that was not fitted has no number and keeps
    its offsets.
    """
    layout, values, delay = whole.fit.model.layout, whole.corrections, whole.delay
    if abs(delay) > 0.1 * (log.time[1] - log.time[0]):  # otherwise the log is unchanged
        log = replace(log, torque=linear(log.time + delay, log.time, log.torque))
    if layout.log_effects[0] and number is not None:
        torque = log.torque.copy()
        torque[:, columns] -= effects_of_logs(layout, values[layout.part("log_effects")])[0, number]
        log = replace(log, torque=torque)
    for correction in reversed(CORRECTIONS):
        if correction.apply and layout.sizes[correction.name]:
            log = correction.apply(log, robot, columns, values[layout.part(correction.name)])
    return log
