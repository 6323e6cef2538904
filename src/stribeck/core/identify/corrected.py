"""Correction of robot and logs by the errors that the whole-log method estimates."""

from dataclasses import dataclass, replace

import pinocchio as pin

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.equations.whole_log.corrections import CORRECTIONS
from stribeck.core.equations.whole_log.corrections.correction import Layout
from stribeck.core.equations.whole_log.corrections.model import effects_of_logs
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


@dataclass(frozen=True, eq=False)
class LogCorrection:
    """Correction of gains, zeros, offsets and orientation of a log, and of the delay of its torques, by the estimates.

    It does not refer to the fit, which holds gigabytes for a robot with many joints.

    Attributes
    ----------
    robot, columns
        Corrected robot, and columns of the fitted joints.
    layout, values
        Corrections and their values, shape (c,).
    delay
        Delay of the torques [s].
    """

    robot: Robot
    columns: IntArray
    layout: Layout
    values: Array
    delay: float

    def __call__(self, log: RobotLog, number: int | None = None) -> RobotLog:
        """Correct a log; `number` is its index if it was fitted.

        The offset of the log minus the mean over all logs is subtracted. A log that was not fitted keeps its offsets.
        """
        if abs(self.delay) > 0.1 * (log.time[1] - log.time[0]):  # otherwise the log is unchanged
            log = replace(log, torque=linear(log.time + self.delay, log.time, log.torque))
        if self.layout.log_effects[0] and number is not None:
            torque = log.torque.copy()
            values = self.values[self.layout.part("log_effects")]
            torque[:, self.columns] -= effects_of_logs(self.layout, values)[0, number]
            log = replace(log, torque=torque)
        for correction in reversed(CORRECTIONS):
            if correction.apply and self.layout.sizes[correction.name]:
                log = correction.apply(log, self.robot, self.columns, self.values[self.layout.part(correction.name)])
        return log
