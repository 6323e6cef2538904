"""Plan of motions that identify the friction of weak joints."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from stribeck.base.text_table import TextTable
from stribeck.base.typing import Array
from stribeck.errors import SettingsError, did_you_mean
from stribeck.friction_torque.preparation import Progress, quiet
from stribeck.plan.advice import LONGEST, JointAdvice, advise
from stribeck.plan.collision import load_self_collision
from stribeck.plan.information import dynamics_of, noise_of, present_motions
from stribeck.plan.joint import PlannedJoint, Reach, guess
from stribeck.plan.series import PERIOD, Task
from stribeck.plan.trajectory import Trajectory, design
from stribeck.result import JointResult, Result, read_result
from stribeck.robot import Robot


@dataclass(frozen=True, kw_only=True, repr=False)
class Plan:
    """Motions that identify the friction of weak joints.

    Attributes
    ----------
    robot
        Name of the robot.
    joints
        Advice by joint, for joints that are weak or not excited.
    notes
        Assumptions and limits.
    trajectory
        Trajectory of all these joints; None if not requested, the base moves, or there is nothing to plan.
    """

    robot: str
    joints: dict[str, JointAdvice]
    notes: list[str]
    trajectory: Trajectory | None = None

    def table(self) -> TextTable:
        """Build a table of the compared motions of each joint, best first, with one sentence per joint."""
        rows = [
            [
                name,
                one.motion,
                (f"{one.slowest:.2g} to " if one.slowest not in (0.0, one.fastest) else "")
                + f"{one.fastest:.2g} {joint.unit}",
                str(one.reversals),
                f"{one.duration:.0f}",
                within(one.relative_width),
                "" if one.needed is None else f"{one.needed:.0f}",
            ]
            for name, joint in self.joints.items()
            for one in joint.candidates
        ]
        return TextTable(
            title=f"Motions for {self.robot}",
            left=["joint", "motion"],
            right=["speed", "reversals", "duration [s]", "expected interval", "sufficient duration [s]"],
            rows=rows,
            notes=[f"{name} {joint.verdict}: {joint.advice}" for name, joint in self.joints.items()],
        )

    def _repr_html_(self) -> str:
        """Format the table for notebooks."""
        return self.table().html()

    def __repr__(self) -> str:
        joints = f"{len(self.joints)} joint{'s' * (len(self.joints) != 1)}"
        return f"Plan({self.robot!r}, {joints}, {'with' if self.trajectory else 'no'} trajectory)"

    def to_json(self) -> str:
        """Format the content of plan.json."""
        plain = asdict(self)
        if self.trajectory:
            del plain["trajectory"]["motion"]  # a function
        document = {"schema": 1} | {key: plain[key] for key in ("robot", "joints", "trajectory", "notes")}
        return json.dumps(document, indent=2, allow_nan=False) + "\n"


def within(width: float) -> str:
    """Format half of an interval divided by its value."""
    return f"± {100 * width:.2g} %" if width < 1 else "unknown"


def plan(
    result: Result | str | Path,
    robot: Robot | str | Path,
    *,
    joints: Sequence[str] | None = None,
    held: str | None = None,
    duration: float | None = None,
    progress: Progress = quiet,
) -> Plan:
    """Plan motions that identify the friction of joints that are weak or not excited.

    Parameters
    ----------
    result
        Result of `identify`, or the path of a result.json with its friction_torque.parquet in the same folder.
    robot
        The robot, or the path of its robot file.
    joints
        Joints to plan for; all weak or not excited joints if None.
    held
        Base axis that points up if a floating robot's base is held still: "x", "-x", "y", "-y", "z" or "-z".
    duration
        Duration of the trajectory of all these joints [s]; no trajectory if None, or if the base moves.
    progress
        Callback `progress(stage, fraction)`.

    Returns
    -------
    plan
        Expected result of each motion.

    Raises
    ------
    SettingsError
        If a file or an option cannot be used.

    Examples
    --------
    >>> plan("out/result.json", "robot.toml").joints
    {}
    """
    robot = robot if isinstance(robot, Robot) else Robot.from_file(robot)
    if robot.loops:
        raise SettingsError(f"plan: takes a robot for a tree, and [[robot.loops]] of {robot.path} close it")
    if duration is not None and not PERIOD <= duration <= LONGEST:
        raise SettingsError(f"plan: the duration is {duration:g} s; expected {PERIOD:g} to {LONGEST:g} s")
    found = result if isinstance(result, Result) else read_result(result)
    chosen = _chosen(found, robot, joints)
    dynamics = dynamics_of(robot, gravity(robot, held or "z"), robot.settings.priors)
    if not chosen:
        return Plan(robot=found.robot, joints={}, notes=[])
    posture = posture_of(robot, found)
    planned = {name: _planned(name, found.joints, robot, posture) for name in found.joints}
    motions = present_motions(found, planned)
    noise = noise_of(planned, motions)
    planned = {name: replace(planned[name], noise=noise[name]) for name in chosen}
    advice = {}
    for k, (name, joint) in enumerate(planned.items()):
        progress(f"moving {name}", 0.2 * k / len(planned))
        advice[name] = advise(joint, motions[name], found.log.duration, dynamics, posture, _how(robot, joint.column))
    guessed = ", ".join(name for name, joint in planned.items() if joint.guessed)
    known = f"{guessed}: no data; the median friction of the other joints is assumed"
    notes = [known] if guessed else []
    advised = Plan(robot=found.robot, joints=advice, notes=notes)
    if duration is None:
        return advised
    if robot.base == "floating" and held is None:
        moves = "no trajectory, because the base moves; if it is held, name its axis that points up (`held`)"
        return replace(advised, notes=[*notes, moves])
    progress("searching a trajectory", 0.2)
    bodies, of_bodies = load_self_collision(robot, posture)
    task = Task(dynamics, list(planned.values()), posture)
    trajectory, of_trajectory = design(task, duration, bodies)
    return replace(advised, notes=[*notes, *of_bodies, *of_trajectory], trajectory=trajectory)


def _chosen(result: Result, robot: Robot, joints: Sequence[str] | None) -> list[str]:
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


def _planned(name: str, joints: Mapping[str, JointResult], robot: Robot, posture: Array) -> PlannedJoint:
    """Describe a joint; without an estimate, its friction is the median of the other joints of its kind."""
    column, joint = robot.joint_names.index(name), joints[name]
    prismatic = robot.prismatic[column]
    if guessed := not joint.curve:
        same = (other for other in joints if robot.prismatic[robot.joint_names.index(other)] == prismatic)
        joint = guess(joint, [found for other in same if (found := joints[other]).curve and found.torque_unit is None])
    return PlannedJoint(
        column=column,
        found=joint,
        guessed=guessed,
        prismatic=prismatic,
        settings=robot.settings,
        reach=_reach(robot, column, joint, posture[column]),
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


def _reach(robot: Robot, column: int, joint: JointResult, middle: float) -> Reach:
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


def _how(robot: Robot, column: int) -> dict[str, str]:
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
