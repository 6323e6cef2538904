"""Joint torques from torques before the gear, motor currents, or commands."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stribeck.base.typing import Array
from stribeck.errors import SettingsError
from stribeck.log.readers.mapping import CURRENT

if TYPE_CHECKING:
    from stribeck.robot import Robot


def check_current(robot: Robot) -> None:
    """Refuse amperes unless the torque source is a current, and torque constants without amperes.

    Raises
    ------
    SettingsError
        If unit, torque source and torque constants contradict each other.
    """
    unit = robot.log_table.torque.unit
    if unit in CURRENT and robot.torque_source != "motor_current":
        raise SettingsError(
            f"{robot.path}: [log.torque] unit is '{unit}', and [robot] torque_source is '{robot.torque_source}'; "
            "unit 'A' requires torque_source = 'motor_current'"
        )
    known = [name for name, motor in robot.motors.items() if motor.torque_constant is not None]
    if known and unit not in CURRENT:
        raise SettingsError(
            f"{robot.path}: [robot.motors.{known[0]}] has a torque_constant, and [log.torque] unit is "
            f"'{unit or 'Nm'}'; expected unit = 'A', or no torque_constant"
        )


def through_motors(torque: Array, robot: Robot) -> tuple[str, ...]:
    """Convert torques before the gear or currents, shape (T, n), to joint torques in place.

    Returns
    -------
    in_amperes
        Joints whose torque is still a current, because their torque constant is unknown.
    """
    currents = robot.log_table.torque.unit in CURRENT
    unknown = []
    for column in robot.torque_controlled if currents or robot.motors else ():
        name = robot.joint_names[column]
        motor = robot.motors.get(name)
        if currents and (motor is None or motor.torque_constant is None):
            unknown.append(name)
        elif motor is not None:
            torque[:, column] *= motor.ratio * (motor.torque_constant or 1.0)
    return tuple(unknown)


def command_and_feedback(channels: dict[str, Array], time: Array, robot: Robot) -> tuple[Array, Array, str]:
    """Compute both parts of the torque kp (q_d - q) + kd (v_d - v) + tau_ff that drives apply, shape (T, n) each.

    The command, kp q_d + kd v_d + tau_ff, acts later than it is logged; the feedback of positions and velocities acts
    at once. Desired velocities and torques that the log does not have are zero; joint velocities are differentiated.

    Returns
    -------
    command, feedback, note
        Both torques [N m], and a sentence that lists their channels.
    """
    assert robot.command_gains is not None
    kp, kd = robot.command_gains
    command, feedback = kp * channels["desired_position"], -kp * channels["position"]
    terms = ["kp (desired_position - position)"]
    if kd.any():
        velocity = channels.get("velocity")
        differentiated = "" if velocity is not None else "differentiated "
        feedback -= kd * (np.gradient(channels["position"], time, axis=0) if velocity is None else velocity)
        command += kd * channels.get("desired_velocity", 0.0)
        terms.append(
            f"kd (desired_velocity - {differentiated}velocity)"
            if "desired_velocity" in channels
            else f"- kd {differentiated}velocity"
        )
    if "desired_torque" in channels:
        command += channels["desired_torque"]
        terms.append("desired_torque")
    idle = [name in robot.position_controlled for name in robot.joint_names]
    command[:, idle] = feedback[:, idle] = 0.0  # their columns are ignored
    note = f"Torques are computed from the command, {' + '.join(terms)}".replace("+ - ", "- ")
    return command, feedback, f"{note}; measured torques in the log are ignored."
