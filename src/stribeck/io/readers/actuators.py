"""Joint torques from torques before the gear, motor currents, or commands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.errors import LogError, SettingsError, listed
from stribeck.core.log.interpolation import delayed
from stribeck.io.readers.mapping import CURRENT

if TYPE_CHECKING:
    from stribeck.core.robot import Robot


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


def commanded_torques(channels: dict[str, Array], time: Array, robot: Robot) -> tuple[dict[str, Any], list[str]]:
    """Compute the torque kp (q_d - q) + kd (v_d - v) + tau_ff that drives apply.

    The command, kp q_d + kd v_d + tau_ff, acts `[robot] command_delay` later than it is logged, or `[log.torque] delay`
    earlier; the feedback of positions and velocities acts at once. Missing desired velocities and torques are zero;
    missing joint velocities are differentiated. Joints without kp have kp = 1: their torque is the deflection of the
    command [rad], [m]. An effort limit is ignored if more than a fifth of the samples exceed it.

    Returns
    -------
    fields, notes
        Fields of RobotLog (torque, its parts, effort limits and unscaled joints), and notes for the user.

    Raises
    ------
    LogError
        If desired torques need an unknown kp.
    """
    assert robot.command_gains is not None
    kp, kd = robot.command_gains
    unknown = tuple(name for name, value in zip(robot.joint_names, kp, strict=True) if np.isnan(value))
    if unknown and channels.get("desired_torque", np.zeros(1)).any():
        missing = f"[robot] kp has no value for joint '{unknown[0]}'"
        raise LogError(f"{robot.path}: {missing}; the log's desired torques require it")
    kp = np.nan_to_num(kp, nan=1.0)
    command, feedback = kp * channels["desired_position"], -kp * channels["position"]
    terms = "kp (desired_position - position)"
    if kd.any():
        velocity = channels.get("velocity")
        speed = "differentiated velocity" if velocity is None else "velocity"
        feedback -= kd * (np.gradient(channels["position"], time, axis=0) if velocity is None else velocity)
        command += kd * channels.get("desired_velocity", 0.0)
        terms += f" + kd (desired_velocity - {speed})" if "desired_velocity" in channels else f" - kd {speed}"
    if "desired_torque" in channels:
        command += channels["desired_torque"]
        terms += " + desired_torque"
    idle = [name in robot.position_controlled for name in robot.joint_names]
    command[:, idle] = feedback[:, idle] = 0.0  # their columns are ignored
    delay = np.zeros(len(kp)) if robot.command_delay is None else robot.command_delay
    command = delayed(command, time, delay - robot.log_table.torque.delay)
    torque = command + feedback
    most = np.where(np.isin(robot.joint_names, unknown), np.inf, robot.effort_limits)
    beyond = np.mean(np.abs(torque) > most, axis=0)
    limits = np.where(beyond < 0.2, most, np.inf)
    notes = [f"Torques are computed from the command, {terms}; measured torques in the log are ignored."]
    for what, share in (("clipped at", beyond < 0.2), ("not clipped: too many exceed", beyond >= 0.2)):
        if joints := [name for name, match, far in zip(robot.joint_names, share, beyond, strict=True) if match and far]:
            notes.append(f"Commanded torques of {listed(joints)} are {what} the effort limits of the model.")
    parts = {"torque": np.clip(torque, -limits, limits), "command": command, "feedback": feedback}
    return parts | {"effort_limits": tuple(limits.tolist()), "unscaled": dict.fromkeys(unknown, 1.0)}, notes
