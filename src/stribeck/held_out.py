"""What was found against a log that no fit has seen."""

from dataclasses import replace

import numpy as np

from stribeck.errors import errors_about
from stribeck.friction_torque.stage import torque_chunks
from stribeck.friction_torque.thinning import MOST_KEPT
from stribeck.identification.judgement.speed import top_speed
from stribeck.identification.judgement.torque_r2 import LEAST_SAMPLES
from stribeck.methods import Fitted
from stribeck.preparation import PreparedLog
from stribeck.result import HeldOutError, HeldOutLog, JointResult, Result
from stribeck.result.provenance import sha256
from stribeck.robot import Robot
from stribeck.settings import Settings
from stribeck.typing import Array

COMMON = {"filter_torque": True, "averaged_law": False, "standing_legs": False, "double_support": "skip"}
"""Of all methods, as `stribeck replay` compares: torque and motion pass the same filter, limbs swing or are free."""


def held_out_log(prepared: PreparedLog, fitted: Fitted, result: Result, robot: Robot, settings: Settings) -> HeldOutLog:
    """Return the errors of the torques of a log by the robot, the sensors' errors and the friction that were found.

    At rest Coulomb friction holds against any torque: samples slower than `settings.rest` times a joint's top speed do
    not count.

    Parameters
    ----------
    robot
        As it was given.
    settings
        With the filter that was chosen.

    Raises
    ------
    LogError
        If the log is too short for the filter.
    """
    given = prepared.log
    log = fitted.correct(given) if fitted.correct else given
    settings = settings.model_copy(update=COMMON | {"observer_bandwidth": None})
    stride = max(1, -(-len(log.time) // MOST_KEPT))
    parts: list[tuple[Array, ...]] = []
    names: tuple[str, ...] = ()
    with errors_about(given.path):
        for chunk in torque_chunks(replace(prepared, log=log), fitted.robot, settings):
            names = chunk.samples.joint_names
            columns = np.array([robot.joint_names.index(name) for name in names])
            for rows in chunk.runs():
                samples, here = chunk.samples, chunk.rows[rows]
                torque, left = samples.torque, samples.friction_torque[rows]
                assert torque is not None  # the friction torque is worked out from it
                warm = None if log.temperature is None else log.temperature[np.ix_(here, columns)]
                motion = samples.velocity[rows], samples.acceleration[rows], log.position[np.ix_(here, columns)]
                rotor, friction = _explained(
                    result, names, robot, motion, torque[rows] - left, warm, prepared.sampling.period
                )
                usable = np.where(samples.usable[rows], 1.0, np.nan)
                found = motion[0], torque[rows], usable * (left - rotor), left - rotor - friction
                parts.append(tuple(part[::stride] for part in found))
    duration = float(given.time[-1] - given.time[0])
    errors = _errors(names, [np.concatenate(part) for part in zip(*parts, strict=True)], settings) if parts else {}
    return HeldOutLog(path=given.path, sha256=sha256(given.path), duration=duration, joints=errors)


def _errors(names: tuple[str, ...], parts: list[Array], settings: Settings) -> dict[str, HeldOutError]:
    """Return each joint's errors from velocity, torque, and what is left of it without and with friction."""
    velocity, torque, without, error = parts
    found: dict[str, HeldOutError] = {}
    for column, name in enumerate(names):
        kept = np.isfinite(without[:, column] + error[:, column] + torque[:, column])
        kept &= np.abs(velocity[:, column]) >= settings.rest * top_speed(velocity[kept, column])
        variance = float(np.var(torque[kept, column])) if np.count_nonzero(kept) >= LEAST_SAMPLES else 0.0
        if variance > 0:
            square, before = (float(np.mean(part[kept, column] ** 2)) for part in (error, without))
            found[name] = HeldOutError(
                rms=square**0.5,
                rms_zero_friction=before**0.5,
                torque_r2=1 - square / variance,
                samples=int(kept.sum()),
            )
    return found


def _explained(
    result: Result,
    names: tuple[str, ...],
    robot: Robot,
    motion: tuple[Array, Array, Array],
    load: Array,
    temperature: Array | None,
    period: float,
) -> tuple[Array, Array]:
    """Return the torque of rotors and of friction that were found [N m], shape (T, n); NaN of joints without any."""
    velocity, acceleration, position = motion
    rotor, friction = np.zeros(load.shape), np.full(load.shape, np.nan)
    for column, name in enumerate(names):
        joint = result.joints.get(name)
        if joint is None or not (joint.parameters or joint.verdict == "no friction"):
            continue
        own = robot.armature[robot.joint_names.index(name)]
        rotor[:, column] = _rotor(joint, float(own)) * acceleration[:, column]
        warmer: Array | float = 0.0
        if temperature is not None and joint.mean_temperature is not None:
            warmer = temperature[:, column] - joint.mean_temperature
        friction[:, column] = joint.friction(velocity[:, column], load[:, column], warmer, position[:, column], period)
    for coupling in result.couplings.values():
        acting = np.array([coupling.joints.get(name, 0.0) for name in names])
        if coupling.parameters:
            rotor += np.outer(_rotor(coupling, 0.0) * (acceleration @ acting), acting)
            friction += np.outer(coupling.friction(velocity @ acting), acting)
    return rotor, friction


def _rotor(joint: JointResult, known: float) -> float:
    """Return the rotor inertia that was found beyond what the model has [kg m^2]."""
    return joint.parameters["armature"].value - known if "armature" in joint.parameters else 0.0
