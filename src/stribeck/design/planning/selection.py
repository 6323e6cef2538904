"""Choice of joints to plan for, with their friction, noise, posture and limits; assumptions before the first log."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.base.version import __version__
from stribeck.core.errors import SettingsError, did_you_mean
from stribeck.core.friction import get_law
from stribeck.core.judgement.excitation import Excitation
from stribeck.core.judgement.reason import Reason
from stribeck.core.judgement.verdict import not_excited
from stribeck.core.result import JointResult, LogSummary, Result, law_values
from stribeck.core.robot import Robot
from stribeck.design.planning.joint import PlannedJoint, Reach, guess

NOISE, RATE = 0.01, 1000.0
"""Assumed white torque noise before the first log, relative to the torque limit [1], and rate of that log [Hz]."""


def chosen_joints(result: Result, robot: Robot, joints: Sequence[str] | None) -> list[str]:
    """Select the joints to plan for; raise SettingsError for names that cannot be planned for."""
    strangers = [name for name in result.joints if name not in robot.joint_names]
    if strangers:
        raise SettingsError(f"{robot.path}: has no joint '{strangers[0]}'; use the robot file of the result's log")
    if joints is None:
        return [name for name, joint in result.joints.items() if joint.verdict in ("weak", "not excited")]
    for name in joints:
        if name not in result.joints:
            near = did_you_mean(name, result.joints)
            raise SettingsError(f"plan: joint '{name}' is not in the result; it has {', '.join(result.joints)}{near}")
        if result.joints[name].verdict == "no friction":
            raise SettingsError(f"plan: {name} has no friction; omit this joint")
    return list(joints)


def planned_joint(name: str, joints: Mapping[str, JointResult], robot: Robot, posture: Array) -> PlannedJoint:
    """Describe a joint; without an estimate, its friction is the median of the other joints of its kind."""
    column, joint = robot.joint_names.index(name), joints[name]
    prismatic = robot.prismatic[column]
    if guessed := not joint.curve or law_values(get_law(joint.law), joint.values) is None:
        same = (other for other in joints if robot.prismatic[robot.joint_names.index(other)] == prismatic)
        joint = guess(joint, [peer for other in same if (peer := joints[other]).curve and peer.torque_unit is None])
    return PlannedJoint(
        column=column,
        result=joint,
        guessed=guessed,
        prismatic=prismatic,
        settings=robot.settings,
        reach=reach_of(robot, column, joint, posture[column]),
    )


def gravity(robot: Robot, held: str) -> Array:
    """Compute gravity in base coordinates [m/s²], shape (3,); the axis `held` of a floating base points up."""
    axes = ("x", "-x", "y", "-y", "z", "-z")
    if held not in axes:
        raise SettingsError(f"plan: held is '{held}'; expected an axis of the base, one of {', '.join(axes)}")
    if robot.base == "fixed":
        return robot.gravity
    axis = np.eye(3)["xyz".index(held[-1])] * (-1 if held[0] == "-" else 1)
    return np.asarray(-np.linalg.norm(robot.gravity) * axis)


def posture_of(robot: Robot, result: Result) -> Array:
    """Compute the middle of each joint's range in the log [rad], [m], shape (n,), within its limits; 0 if unknown."""
    low, high = robot.position_limits
    middle = np.zeros(len(robot.joint_names))
    for k, name in enumerate(robot.joint_names):
        joint = result.joints.get(name)
        if joint is not None and joint.position_range is not None:
            middle[k] = np.mean(joint.position_range)
    return np.clip(middle, low, high)


def reach_of(robot: Robot, column: int, joint: JointResult, middle: float) -> Reach:
    """Limit a joint's motion to 0.9 of the model's range and 0.8 of its speed, at most twice the speed of the log.

    Without a range, the joint stays within 1 rad or 0.1 m of the middle of the log, or in the log's range. Speeds up
    to 1 rad/s or 0.1 m/s are always allowed.
    """
    usual = 0.1 if robot.prismatic[column] else 1.0
    low, high = (limits[column] for limits in robot.position_limits)
    if np.isfinite(low) and np.isfinite(high):
        slack = (1 - 0.9) / 2 * (high - low)
        low, high = low + slack, high - slack
    else:
        seen = joint.position_range or (middle, middle)
        low, high = min(seen[0], middle - usual), max(seen[1], middle + usual)
    speed = min(0.8 * robot.speed_limits[column], max(usual, 2.0 * np.abs(joint.velocity_range).max()))
    return Reach(middle=float((low + high) / 2), amplitude=float((high - low) / 2), speed=float(speed))


def how_to_move(robot: Robot, column: int) -> dict[str, str]:
    """Describe how a walker performs each motion, by the motion's name; empty for a robot without feet."""
    foot = next((name for name in robot.contacts if robot.standing((name,))[column]), None)
    if foot is None:
        return {}
    tree = robot.tree
    direction = np.abs(tree.axes[int(np.flatnonzero(tree.columns == column)[0])].direction)
    steps = ("sideways steps", "longer or higher steps", "turning steps")[int(np.argmax(direction))]
    in_the_air = f" with {foot} in the air"
    return {
        **dict.fromkeys(("slow", "fast", "slow to fast", "frequent reversals"), in_the_air),
        "the present motion twice as fast": f" ({steps})",
        "the present motion half as fast": " (slower steps)",
    }


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
