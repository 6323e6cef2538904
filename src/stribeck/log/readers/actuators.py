"""Joint torques from torques before the gear, motor currents, or commands."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stribeck.base.typing import Array
from stribeck.errors import LogError, SettingsError
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
    unscaled
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


def without_kp(robot: Robot) -> tuple[str, ...]:
    """List the joints whose kp is unknown."""
    kp = () if robot.command_gains is None else robot.command_gains[0]
    return tuple(name for name, value in zip(robot.joint_names, kp, strict=False) if np.isnan(value))


def command_and_feedback(channels: dict[str, Array], time: Array, robot: Robot) -> tuple[Array, Array, str]:
    """Compute both parts of the torque kp (q_d - q) + kd (v_d - v) + tau_ff that drives apply, shape (T, n) each.

    The command, kp q_d + kd v_d + tau_ff, acts later than it is logged; the feedback of positions and velocities acts
    at once. Desired velocities and torques that the log does not have are zero; joint velocities are differentiated.
    Joints without kp have kp = 1: their torque is the deflection of the command [rad], [m].

    Returns
    -------
    command, feedback, note
        Both torques [N m], and a sentence that lists their channels.

    Raises
    ------
    LogError
        If desired torques need an unknown kp.
    """
    assert robot.command_gains is not None
    (kp, kd), unknown = robot.command_gains, without_kp(robot)
    if unknown and channels.get("desired_torque", np.zeros(1)).any():
        missing = f"[robot] kp has no value for joint '{unknown[0]}'"
        raise LogError(f"{robot.path}: {missing}; the log's desired torques require it")
    kp = np.nan_to_num(kp, nan=1.0)
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
