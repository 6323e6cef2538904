"""Friction torque along the motion of a log, for `Result.predict` and `Result.score`, and the robot of a result."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from stribeck.core.base.files import sha256
from stribeck.core.base.typing import Array
from stribeck.core.equations.friction_torque.preparation import as_read, prepare
from stribeck.core.equations.friction_torque.stage import with_filter
from stribeck.core.errors import SettingsError, errors_about
from stribeck.core.identify.held_out import explained_runs
from stribeck.core.identify.pipeline import find_torques
from stribeck.core.judgement.torque_error import COMMON, torque_errors
from stribeck.core.log import LogLike, RobotLog
from stribeck.core.log.interpolation import linear
from stribeck.core.result import Corrections, Result
from stribeck.core.result.bodies import with_bodies
from stribeck.core.robot import Robot


def find_robot(result: Result, robot: Robot | str | Path | None) -> Robot:
    """Return a robot, or read it from its file, by default from that of the identification: `Result.find_robot`."""
    if robot is not None:
        return robot if isinstance(robot, Robot) else Robot.from_file(robot)
    where, stamp, problem = result.path or result.robot, result.robot_file, "does not state its robot file"
    if stamp:
        given = Path(stamp.path)
        places = [path for path in (given, Path(result.path).parent / given.name) if path.is_file()]
        if same := [path for path in places if sha256(str(path)) == stamp.sha256]:
            return Robot.from_file(same[0])
        problem = f"has the robot file {given}, which {'has changed since' if places else 'does not exist'}"
    raise SettingsError(f"{where}: {problem}; pass the robot (--robot FILE)")


def friction_of_log(result: Result, log: LogLike, robot: Robot | str | Path | None) -> tuple[Array, dict[str, float]]:
    """Compute the friction torque along the motion of a log, and R² of the measured friction torque.

    Uses the bodies, gains, zeros and torque delay of the result's corrections.

    Returns
    -------
    friction
        Friction torque with offset at the T samples of the log, of the k joints of the result [N m], [N], shape (T, k);
        NaN where unknown.
    scores
        R² by joint with friction, over the samples of `torque_errors`.

    Raises
    ------
    RobotFileError, LogError, SettingsError
        If the log, or the result for this robot, cannot be used.
    """
    machine, known = find_robot(result, robot), result.corrections or Corrections(chi_square=1.0)
    log, names = as_read(log, machine), [machine.joint_names[column] for column in machine.torque_controlled]
    settings = machine.settings.model_copy(update=COMMON)
    (prepared,), _, _, machine = find_torques([prepare(log, machine, settings)], machine, settings, [])
    settings, _ = with_filter(prepared, machine, settings)
    prepared = replace(prepared, log=_corrected(prepared.log, known))
    velocity, measured, friction = np.full((3, len(prepared.log.time), len(names)), np.nan)
    with errors_about(log.path):
        for rows, channels in explained_runs(result, prepared, with_bodies(machine, known), machine, settings):
            velocity[rows], _, measured[rows], friction[rows] = channels
    (errors,) = torque_errors(names, velocity, measured, [measured - friction], settings.rest)
    sliding = [name for name, joint in result.joints.items() if joint.verdict != "no friction"]
    at_stamps = linear(log.time, prepared.log.time, friction[:, [names.index(name) for name in result.joints]])
    return at_stamps, {name: errors[name].r2 for name in sliding if name in errors}


def _corrected(log: RobotLog, known: Corrections) -> RobotLog:
    """Correct gains and delay of the torques of a log, and zeros of its positions, by the estimates of a result."""
    pairs = [[of.get(name, (0.0,))[0] for of in (known.torque_gain, known.encoder_zero)] for name in log.joint_names]
    gain, zero = np.array(pairs).T
    torque = linear(log.time + (known.torque_delay or (0.0,))[0], log.time, log.torque)
    return replace(log, position=log.position - zero, torque=(1 - gain) * torque)
