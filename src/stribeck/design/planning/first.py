"""Assumptions before the first log: joints that have not moved, and torque noise relative to the limits."""

from dataclasses import replace

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.base.version import __version__
from stribeck.core.judgement.excitation import Excitation
from stribeck.core.judgement.reason import Reason
from stribeck.core.judgement.verdict import not_excited
from stribeck.core.result import JointResult, LogSummary, Result
from stribeck.core.robot import Robot

NOISE, RATE = 0.01, 1000.0
"""Assumed white torque noise before the first log, relative to the torque limit [1], and rate of that log [Hz]."""


def before_the_first_log(robot: Robot) -> Result:
    """Make a result in which no joint has moved; a trajectory may use half of the model's speed limits."""
    speeds = np.where(np.isfinite(robot.speed_limits), robot.speed_limits / 4, 0.0).tolist()
    joints = dict[str, JointResult]()
    for name, speed, ends in zip(robot.joint_names, speeds, np.transpose(robot.position_limits).tolist(), strict=True):
        still = Excitation(samples=0, blocks=0, velocity_range=(-speed, speed), reversals=0, reason=Reason("no log"))
        joints[name] = replace(not_excited(still), position_range=tuple(ends) if np.isfinite(ends).all() else None)
    log = LogSummary(path="", sha256="", duration=0.0, rate=0.0, samples_used=0)
    return Result(robot=robot.name, log=log, law="coulomb-viscous", method="", joints=joints, stribeck=__version__)


def assumed_noise(robot: Robot) -> Array:
    """Compute the assumed standard deviation of the torques [N m], [N], shape (n,); of 100 N m without a limit."""
    return np.asarray(NOISE * np.where(np.isfinite(robot.effort_limits), robot.effort_limits, 100.0))


def assumed_density(robot: Robot) -> dict[str, float]:
    """Compute the assumed spectral density of each joint's torque noise [N² m² s]."""
    return dict(zip(robot.joint_names, (assumed_noise(robot) ** 2 / RATE).tolist(), strict=True))


def missing_limits(robot: Robot, joints: list[str]) -> list[str]:
    """Note which limits the model lacks for a trajectory of some joints."""
    notes = [
        f"{name}: the model has no speed limit; at most {'0.1 m/s' if prismatic else '1 rad/s'}"
        for name, prismatic, limit in zip(robot.joint_names, robot.prismatic, robot.speed_limits, strict=True)
        if name in joints and not np.isfinite(limit)
    ]
    if not np.isfinite(robot.effort_limits).all():
        notes.append("the model does not limit all torques; check them before you run the trajectory")
    return notes
