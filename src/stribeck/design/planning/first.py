"""Trajectory before the first log: for Coulomb and viscous friction, with torque noise relative to the limits."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.base.version import __version__
from stribeck.core.errors import SettingsError
from stribeck.core.judgement.excitation import Excitation
from stribeck.core.judgement.reason import Reason
from stribeck.core.judgement.verdict import not_excited
from stribeck.core.result import LogSummary, Result
from stribeck.core.robot import Robot
from stribeck.design.planning.collision import load_self_collision
from stribeck.design.planning.information import dynamics_of
from stribeck.design.planning.selection import chosen_joints, gravity, planned_joint, reach_of
from stribeck.design.planning.series import Task
from stribeck.design.planning.trajectory import Trajectory, design

NOISE, RATE = 0.01, 1000.0
"""Assumed white torque noise before the first log, relative to the torque limit [1], and rate of that log [Hz]."""


def first_trajectory(
    robot: Robot, joints: Sequence[str] | None, held: str | None, duration: float
) -> tuple[Trajectory, list[str]]:
    """Design a trajectory within the limits of the model, and notes on it.

    Raises
    ------
    SettingsError
        If the base moves, or an option cannot be used.
    """
    if robot.base == "floating" and held is None:
        raise SettingsError("plan: the base moves; hold it and name its axis that points up (`--held z`)")
    result = _before_the_first_log(robot)
    dynamics = dynamics_of(robot, gravity(robot, held or "z"), robot.settings.priors)
    middle = [reach_of(robot, k, joint, 0.0).middle for k, joint in enumerate(result.joints.values())]
    posture = np.clip(middle, *robot.position_limits)
    planned = [
        replace(planned_joint(name, result.joints, robot, posture), noise=assumed_noise(robot)[k] ** 2 / RATE)
        for k, name in enumerate(robot.joint_names)
        if name in chosen_joints(result, robot, joints)
    ]
    bodies, notes = load_self_collision(robot, posture)
    least = {False: "1 rad/s", True: "0.1 m/s"}
    notes += [
        f"{robot.joint_names[joint.column]}: the model has no speed limit; at most {least[joint.prismatic]}"
        for joint in planned
        if not np.isfinite(robot.speed_limits[joint.column])
    ]
    if not np.isfinite(robot.effort_limits).all():
        notes.append("the model does not limit all torques; check them before you run the trajectory")
    trajectory, more = design(Task(dynamics, planned, posture), duration, bodies, predict=False)
    return trajectory, [*notes, *more]


def assumed_noise(robot: Robot) -> Array:
    """Compute the assumed standard deviation of the torques [N m], [N], shape (n,); of 100 N m without a limit."""
    return np.asarray(NOISE * np.where(np.isfinite(robot.effort_limits), robot.effort_limits, 100.0))


def _before_the_first_log(robot: Robot) -> Result:
    """Make a result in which no joint has moved; a trajectory may use half of the model's speed limits."""
    speeds = np.where(np.isfinite(robot.speed_limits), robot.speed_limits / 4, 0.0).tolist()
    joints = {
        name: not_excited(
            Excitation(samples=0, blocks=0, velocity_range=(-speed, speed), reversals=0, reason=Reason("no log"))
        )
        for name, speed in zip(robot.joint_names, speeds, strict=True)
    }
    log = LogSummary(path="", sha256="", duration=0.0, rate=0.0, samples_used=0)
    return Result(robot=robot.name, log=log, law="coulomb-viscous", method="", joints=joints, stribeck=__version__)
