"""Free simulation of a robot with a held base under the commands of a log, by MuJoCo.

The drives apply the torque

    tau = clip(kp (q_des - q) + kd (v_des - v) + tau_des, limits)

to the joints, where q_des, v_des and tau_des hold from one stamp to the next and act late. Nothing measured enters
after the start, so that the positions show all errors of a model: inertia, friction, rotors and offsets.
"""

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from tempfile import TemporaryDirectory

import mujoco
import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.core.robot.mjcf import compile_mjcf, quiet_mujoco
from stribeck.core.robot.xml_file import read_xml
from stribeck.design.replaying.comparison import CommandedMotion
from stribeck.design.replaying.rollouts import STEP
from stribeck.simulation import mjcf_of_urdf


def commanded_motion(
    logs: Sequence[RobotLog], robot: Robot, models: tuple[Path, Path], delays: Array, seconds: float = 8.0
) -> CommandedMotion | None:
    """Simulate two models under the commands of logs, from their first positions on.

    Parameters
    ----------
    logs
        Logs as read, with commands.
    robot
        Robot with a fixed base and the gains of its drives.
    models
        Model files, MJCF or URDF: as given, and another one.
    delays
        Delay of each joint's commands [s], shape (n,), if they are interpolated between stamps.
    seconds
        Duration of each simulation [s].

    Returns
    -------
    motion
        Position errors, or None if a simulation diverges.
    """
    chosen = [_start(log, seconds) for log in logs]
    errors = []
    for path in models:
        model = _compiled(path, robot)
        errors.append([_error(_simulate(model, robot, log, delays), log, robot) for log in chosen])
    as_given, other = np.sqrt(np.mean(np.square(errors), axis=1)).tolist()
    if not np.isfinite([as_given, other]).all():
        return None
    alike = 0.006  # commands that differ less are of the same motion [rad], [m]
    differences = [
        np.sqrt(np.mean((first.position[:rows] - next_.position[:rows]) ** 2))
        for first, next_ in combinations(chosen, 2)
        for rows in [min(len(first.time), len(next_.time))]
        if np.sqrt(np.mean((_command(first, robot)[0][:rows] - _command(next_, robot)[0][:rows]) ** 2)) < alike
    ]
    spread = (float(min(differences)), float(max(differences))) if differences else None
    return CommandedMotion(as_given=as_given, other=other, logs=len(logs), seconds=seconds, spread=spread)


def _start(log: RobotLog, seconds: float) -> RobotLog:
    """Cut out the first seconds of a log, without samples that lack a value or a later stamp."""
    known = np.isfinite(log.time) & np.isfinite(log.position).all(axis=1) & (log.time <= np.nanmin(log.time) + seconds)
    for channel in (log.desired_position, log.desired_velocity, log.desired_torque):
        known &= channel is None or np.isfinite(channel).all(axis=1)
    latest = np.maximum.accumulate(np.where(known, log.time, -np.inf))
    return log.take(known & np.append(True, log.time[1:] > latest[:-1]))


def _error(position: Array, log: RobotLog, robot: Robot) -> float:
    """Compute the root mean square of the position error of the joints with drives [rad], [m]."""
    columns = robot.torque_controlled
    return float(np.sqrt(np.mean((position - log.position)[:, columns] ** 2)))


def _command(log: RobotLog, robot: Robot) -> tuple[Array, Array]:
    """Collect the desired positions [rad], [m], and compute the part of the torque that commands cause, (T, n) each."""
    assert log.desired_position is not None
    assert robot.command_gains is not None
    kp, kd = np.nan_to_num(robot.command_gains)
    torque = kp * log.desired_position
    torque += 0.0 if log.desired_velocity is None else kd * log.desired_velocity
    return log.desired_position, torque + (0.0 if log.desired_torque is None else log.desired_torque)


@quiet_mujoco()
def _compiled(path: Path, robot: Robot) -> mujoco.MjModel:
    """Compile a model without contacts and servos, whose base and other joints are held by very large rotors."""
    with TemporaryDirectory() as folder:
        if read_xml(path).kind == "urdf":
            text, _ = mjcf_of_urdf(path, Path(folder), floating=False)
            path = Path(folder) / "model.xml"
            path.write_text(text, encoding="utf-8")
        model = compile_mjcf(path)
    model.opt.timestep, model.opt.integrator = STEP, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.opt.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT
    model.opt.gravity[:] = robot.gravity
    servos = model.actuator_biastype == int(mujoco.mjtBias.mjBIAS_AFFINE)
    model.actuator_gainprm[servos] = model.actuator_biasprm[servos] = 0.0
    driven = {robot.joint_names[k] for k in robot.torque_controlled}
    held = [name not in driven for name in (model.joint(int(joint)).name for joint in model.dof_jntid)]
    rotors = np.zeros(model.nv)
    rotors[[model.joint(name).dofadr[0] for name in robot.joint_names]] = robot.armature
    model.dof_armature[:] = np.where(held, 1e9, np.where(model.dof_armature > 0, model.dof_armature, rotors))
    return model


def _simulate(model: mujoco.MjModel, robot: Robot, log: RobotLog, delays: Array) -> Array:
    """Simulate from the first sample of a log on; return the positions at its times [rad], [m], shape (T, n)."""
    data, time = mujoco.MjData(model), log.time - log.time[0]
    joints = [model.joint(name) for name in robot.joint_names]
    at, of = (np.array([getattr(joint, word)[0] for joint in joints]) for word in ("qposadr", "dofadr"))
    _, command = _command(log, robot)
    assert robot.command_gains is not None
    kp, kd = np.nan_to_num(robot.command_gains)
    limits, columns = robot.effort_limits, robot.torque_controlled
    clock = STEP * np.arange(int(np.ceil(time[-1] / STEP)) + 1)
    lags = np.maximum(delays - np.median(np.diff(time)) / 2, 0.0)  # held commands are late by half a period on average
    held = np.stack([np.searchsorted(time, clock - lag + 1e-9, side="right") - 1 for lag in lags], axis=1)
    torque = np.take_along_axis(command, np.maximum(held, 0), axis=0)
    moved = np.stack([np.interp(clock, time, column) for column in log.position.T], axis=1)
    others, trace = np.setdiff1d(np.arange(len(joints)), columns), np.empty_like(moved)
    few = min(5, len(time)) - 1
    data.qpos[at], data.qvel[of[columns]] = moved[0], ((log.position[few] - log.position[0]) / time[few])[columns]
    for step, push in enumerate(torque):
        data.qpos[at[others]], trace[step] = moved[step, others], data.qpos[at]
        applied = push - kp * data.qpos[at] - kd * data.qvel[of]
        data.qfrc_applied[of[columns]] = np.clip(applied, -limits, limits)[columns]
        mujoco.mj_step(model, data)
    return np.stack([np.interp(time, clock, column) for column in trace.T], axis=1)
