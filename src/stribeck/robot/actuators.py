"""What the robot file says of motors and commands: from what a log holds to the torques of joints."""

from collections.abc import Sequence

import numpy as np

from stribeck.errors import RobotFileError
from stribeck.settings import MotorTable, RobotTable
from stribeck.typing import Array, TorqueSource

FELT = {
    "link_side_sensor": "a torque sensor behind the gear does not feel the rotor; set [robot] armature to 0 for those "
    "joints if the model's is the rotor's",
    "motor_side_sensor": "a torque sensor between motor and gear feels what turns behind it, not the rotor; set "
    "[robot] armature to the gear's own part for those joints if the model's is the rotor's",
}
"""Of sensors that do not feel the rotor: what to do about an armature in the model."""


def armature_warning(source: TorqueSource) -> list[str]:
    """Return what is odd about an armature in the model, if the torque is not the motor's."""
    if source not in FELT:
        return []
    return [f"the dynamics include an armature although torque_source is '{source}': {FELT[source]}"]


def motors_of(table: RobotTable, joints: Sequence[str], path: str) -> dict[str, MotorTable]:
    """Return the motors by joint.

    Raises
    ------
    RobotFileError
        If one is of no joint whose torque is measured, or the torque's source has no use for it.
    """
    measured = [name for name in joints if name not in table.position_controlled]
    for name, motor in table.motors.items():
        where = f"{path}: [robot.motors.{name}]"
        if name not in measured:
            raise RobotFileError(f"{where} is of no joint whose torque is measured; those are {', '.join(measured)}")
        if table.torque_source not in ("motor_current", "motor_side_sensor"):
            raise RobotFileError(
                f"{where} is for torque_source 'motor_current' or 'motor_side_sensor', and it is "
                f"'{table.torque_source}'; remove the table or change the source"
            )
        if motor.torque_constant is not None and table.torque_source != "motor_current":
            raise RobotFileError(
                f"{where} torque_constant is for torque_source 'motor_current', and it is '{table.torque_source}'; "
                "expected ratio alone"
            )
    return table.motors


def command_gains(table: RobotTable, joints: Sequence[str], path: str) -> tuple[Array, Array] | None:
    """Return kp and kd in the order of the joints, shape (n,) each; None where commands are torques.

    Raises
    ------
    RobotFileError
        If one of them is missing, for a joint or altogether, names another joint, or the source is no command.
    """
    given = {"kp": table.kp, "kd": table.kd}
    if table.kp is None and table.kd is None:
        return None
    if table.torque_source != "command":
        key = next(key for key, value in given.items() if value is not None)
        raise RobotFileError(
            f"{path}: [robot] {key} is for torque_source 'command', and it is '{table.torque_source}'; remove it or "
            "change the source"
        )
    measured = [name for name in joints if name not in table.position_controlled]
    found = []
    for key, value in given.items():
        if value is None:
            raise RobotFileError(f"{path}: [robot] {key} is missing beside the other gain; expected it, 0.0 for none")
        by_joint = value if isinstance(value, dict) else dict.fromkeys(measured, value)
        if unknown := [name for name in by_joint if name not in measured]:
            raise RobotFileError(
                f"{path}: [robot] {key} names joint '{unknown[0]}'; the torque-controlled joints are "
                f"{', '.join(measured)}"
            )
        if missing := [name for name in measured if name not in by_joint]:
            raise RobotFileError(
                f"{path}: [robot] {key} has no value for joint '{missing[0]}'; expected one for each of "
                f"{', '.join(measured)}, or one number for all"
            )
        found.append(np.array([by_joint.get(name, 0.0) for name in joints]))
    return found[0], found[1]
