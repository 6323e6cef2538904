"""Torque errors on a validation log."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from stribeck.core.base.files import sha256
from stribeck.core.base.typing import Array, IntArray
from stribeck.core.equations.friction_torque.inverse_dynamics import Chunk, torque_chunks
from stribeck.core.equations.friction_torque.preparation import PreparedLog
from stribeck.core.errors import errors_about
from stribeck.core.identify.contract import Fitted
from stribeck.core.judgement.torque_error import COMMON, torque_errors
from stribeck.core.log import RobotLog
from stribeck.core.result import HeldOutError, HeldOutLog, JointResult, Result
from stribeck.core.result.samples import MOST_KEPT
from stribeck.core.robot import Robot
from stribeck.core.settings import Settings


def held_out_log(prepared: PreparedLog, fitted: Fitted, result: Result, robot: Robot, settings: Settings) -> HeldOutLog:
    """Compute the torque errors of a log with the corrected robot and sensors and the friction of the result.

    Parameters
    ----------
    robot
        The robot as given.
    settings
        Settings with the chosen filter.

    Raises
    ------
    LogError
        If the log is too short for the filter.
    """
    given = prepared.log
    log = fitted.correct(given) if fitted.correct else given
    settings = settings.model_copy(update=COMMON)
    names = [robot.joint_names[column] for column in robot.torque_controlled]
    stride = max(1, -(-len(log.time) // MOST_KEPT))
    with errors_about(given.path):
        runs = explained_runs(result, replace(prepared, log=log), fitted.robot, robot, settings)
        parts = [tuple(channel[::stride] for channel in channels) for _, channels in runs]
    errors = {}
    if parts:
        velocity, torque, without, friction = (np.concatenate(part) for part in zip(*parts, strict=True))
        before, after = torque_errors(names, velocity, torque, [without, without - friction], settings.rest)
        errors = {
            name: HeldOutError(
                rms=error.rms, rms_zero_friction=before[name].rms, torque_r2=error.r2, samples=error.samples
            )
            for name, error in after.items()
        }
    duration = float(given.time[-1] - given.time[0])
    return HeldOutLog(path=given.path, sha256=sha256(given.path), duration=duration, joints=errors)


def explained_runs(
    result: Result, prepared: PreparedLog, corrected: Robot, robot: Robot, settings: Settings
) -> Iterator[tuple[IntArray, tuple[Array, ...]]]:
    """Yield rows of a log, with velocity, torque, and measured and explained friction torque, shape (T, n) each."""
    for chunk in torque_chunks(prepared, corrected, settings):
        samples = chunk.samples
        assert samples.torque is not None  # the friction torque uses it
        for rows in chunk.runs():
            rotor, friction = _explained(result, robot, prepared.log, chunk, rows, prepared.sampling.period)
            measured = np.where(samples.usable[rows], samples.friction_torque[rows] - rotor, np.nan)
            yield chunk.rows[rows], (samples.velocity[rows], samples.torque[rows], measured, friction)


def _explained(
    result: Result, robot: Robot, log: RobotLog, chunk: Chunk, rows: slice, period: float
) -> tuple[Array, Array]:
    """Compute the torque of fitted rotors and of friction in some rows of a chunk [N m], shape (T, n).

    It is NaN for joints without friction.
    """
    samples, names = chunk.samples, chunk.samples.joint_names
    assert samples.torque is not None  # the friction torque uses it
    velocity, acceleration = samples.velocity[rows], samples.acceleration[rows]
    load = samples.torque[rows] - samples.friction_torque[rows]
    place = np.ix_(chunk.rows[rows], np.array([robot.joint_names.index(name) for name in names]))
    position, temperature = log.position[place], None if log.temperature is None else log.temperature[place]
    rotor, friction = np.zeros(load.shape), np.full(load.shape, np.nan)
    for column, name in enumerate(names):
        joint = result.joints.get(name)
        if joint is None or joint.torque_unit or not (joint.parameters or joint.verdict == "no friction"):
            continue
        armature = robot.armature[robot.joint_names.index(name)]
        rotor[:, column] = _rotor(joint, float(armature)) * acceleration[:, column]
        warmer: Array | float = 0.0
        if temperature is not None and joint.mean_temperature is not None:
            warmer = temperature[:, column] - joint.mean_temperature
        friction[:, column] = joint.friction(
            velocity[:, column], load[:, column], warmer, position[:, column], period, offset=True
        )
    for coupling in result.couplings.values():
        acting = np.array([coupling.joints.get(name, 0.0) for name in names])
        if coupling.parameters:
            rotor += np.outer(_rotor(coupling, 0.0) * (acceleration @ acting), acting)
            friction += np.outer(coupling.friction(velocity @ acting, offset=True), acting)
    return rotor, friction


def _rotor(joint: JointResult, known: float) -> float:
    """Compute the fitted rotor inertia minus the model's [kg m^2]."""
    return joint.parameters["armature"].value - known if "armature" in joint.parameters else 0.0
