"""The plan: what would make the friction of weak joints known."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from stribeck.errors import SettingsError, did_you_mean
from stribeck.planning.advice import LONGEST, JointAdvice, advise
from stribeck.planning.assumed import AssumedFriction, guess
from stribeck.planning.collision import load_self_collision
from stribeck.planning.information import dynamics_of
from stribeck.planning.motions import Reach
from stribeck.planning.present import PresentMotion, read_noise, read_present, rough_noise
from stribeck.planning.trajectory import PERIOD, SHORTEST, Task, Trajectory, design
from stribeck.preparation import Progress, quiet
from stribeck.result import JointResult, Result, read_result
from stribeck.robot import Robot
from stribeck.typing import Array

SCHEMA = 1
TABLE = "friction_torque.parquet"

SHARE_OF_ADVICE = 0.2
"""Share of the work that is done before a trajectory is sought [1]."""

UP = ("x", "-x", "y", "-y", "z", "-z")
"""Axes of the base."""

POSITION_SHARE, SPEED_SHARE = 0.9, 0.8
"""Shares of the ranges of position and speed that a plan uses [1]."""

USUAL_RANGE = {False: 1.0, True: 0.1}
"""Where the model has no limit: how far from the middle of the log a joint goes [rad], [m]."""

USUAL_SPEED = {False: 1.0, True: 0.1}
"""How fast a joint goes [rad/s], [m/s] that is slower in the log."""

FASTER = 2.0
"""Speed of a plan over that of the log [1], at most: a robot that was never faster may not stand more."""


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What would make friction known that a log has left weak.

    Attributes
    ----------
    robot
        Its name.
    joints
        By name, what to do about those that are weak or not excited.
    notes
        What was assumed.
    trajectory
        Of all these joints together; None if none was asked for, the base moves, or there is nothing to plan.
    """

    robot: str
    joints: dict[str, JointAdvice]
    notes: list[str]
    trajectory: Trajectory | None = None
    schema: int = SCHEMA

    def to_json(self) -> str:
        """Return the text of plan.json."""
        document = {
            "schema": self.schema,
            "robot": self.robot,
            "joints": {name: asdict(joint) for name, joint in self.joints.items()},
            "trajectory": self.trajectory.to_plain() if self.trajectory else None,
            "notes": self.notes,
        }
        return json.dumps(document, indent=2, allow_nan=False) + "\n"


def plan(
    result: str | Path,
    robot: Robot | str | Path,
    *,
    joints: Sequence[str] | None = None,
    held: str | None = None,
    duration: float | None = None,
    progress: Progress = quiet,
) -> Plan:
    """Say which motion would make the friction of joints known that a log has left weak.

    Parameters
    ----------
    result
        Path of a result.json, with its friction_torque.parquet beside it.
    robot
        The robot, or the path of its robot file.
    joints
        Which joints to plan for; all that are weak or not excited if None.
    held
        Of a floating robot whose base is held still, hung or lying: which of its axes points up, "z", "-x" or another.
    duration
        Length of a trajectory of all these joints together [s]; none is made if None, nor of a base that moves.
    progress
        Told how far the work is.

    Returns
    -------
    plan
        What each motion would bring.

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
    if duration is not None and not SHORTEST <= duration <= LONGEST:
        raise SettingsError(f"plan: the duration is {duration:g} s; expected {SHORTEST:g} to {LONGEST:g} s")
    found = read_result(result)
    chosen = _chosen(found, robot, joints)
    every = {name: joint for name, joint in found.joints.items() if name in robot.joint_names}
    motions = read_present(Path(result).parent / TABLE, every, found.log.rate) if chosen else {}
    noise = _noise(every, motions, robot) if chosen else {}
    dynamics = dynamics_of(robot, gravity(robot, held or "z"), robot.settings.priors)
    posture = posture_of(robot, found)
    columns = {name: robot.joint_names.index(name) for name in chosen}
    friction = {name: _assumed(name, every, robot) for name in chosen}
    reach = {name: reach_of(robot, columns[name], every[name], posture[columns[name]]) for name in chosen}
    advice = {}
    for k, (name, column) in enumerate(columns.items()):
        progress(f"moving {name}", k / len(columns) * SHARE_OF_ADVICE)
        known = friction[name], every[name].verdict, motions[name], found.log.duration, noise[name], reach[name]
        advice[name] = advise(column, *known, dynamics, posture, _how(robot, column))
    notes = _notes(found, chosen)
    if duration is None or not chosen:
        return Plan(robot=found.robot, joints=advice, notes=notes)
    if robot.base == "floating" and held is None:
        notes.append(
            "no trajectory: the base moves; --held says which of its axes points up if the robot hangs or lies"
        )
        return Plan(robot=found.robot, joints=advice, notes=notes)
    progress("seeking a trajectory", SHARE_OF_ADVICE)
    bodies, of_bodies = load_self_collision(robot, posture)
    task = Task(
        dynamics=dynamics,
        friction={columns[name]: friction[name] for name in chosen},
        noise={columns[name]: noise[name] for name in chosen},
        reach={columns[name]: reach[name] for name in chosen},
        posture=posture,
        period=min(duration, PERIOD),
    )
    trajectory, of_trajectory = design(task, duration, bodies)
    return Plan(robot=found.robot, joints=advice, notes=[*notes, *of_bodies, *of_trajectory], trajectory=trajectory)


def _chosen(result: Result, robot: Robot, joints: Sequence[str] | None) -> list[str]:
    """Return the joints to plan for, or say which of them cannot be."""
    strangers = [name for name in result.joints if name not in robot.joint_names]
    if strangers:
        raise SettingsError(
            f"{robot.path}: the robot has no joint '{strangers[0]}' of the result, expected the robot of its log"
        )
    if joints is None:
        return [name for name, joint in result.joints.items() if joint.verdict in ("weak", "not excited")]
    for name in joints:
        if name not in result.joints:
            near = did_you_mean(name, result.joints)
            raise SettingsError(f"plan: joint '{name}' is not in the result; it has {', '.join(result.joints)}{near}")
        if result.joints[name].verdict == "no friction":
            raise SettingsError(f"plan: {name} has no friction that any motion could show; leave it out")
    return list(joints)


def _assumed(name: str, joints: Mapping[str, JointResult], robot: Robot) -> AssumedFriction:
    """Return the friction of a joint, that of others in the middle if the log says nothing of it."""
    joint = joints[name]
    prismatic = robot.prismatic[robot.joint_names.index(name)]
    guessed = not joint.curve
    if guessed:
        others = [
            joints[other]
            for other in joints
            if joints[other].curve and robot.prismatic[robot.joint_names.index(other)] == prismatic
        ]
        joint = guess(joint, others)
    return AssumedFriction(joint, guessed, prismatic, robot.settings.priors, robot.settings.rest)


def _noise(joints: Mapping[str, JointResult], motions: Mapping[str, PresentMotion], robot: Robot) -> dict[str, float]:
    """Return the spectral density of each joint's torque [N^2 m^2 s].

    It is what the intervals of the result say. Of a joint that is not excited it is that of its torque at rest, as much
    larger as intervals of the other joints say.
    """
    found: dict[str, float] = {}
    rough = {}
    for name, motion in motions.items():
        shown = bool(joints[name].curve) and joints[name].verdict != "no friction"
        assumed = _assumed(name, joints, robot) if shown else None
        rough[name] = rough_noise(motion, assumed)
        if assumed is not None:
            found[name] = read_noise(motion, assumed)
    ratios = [found[name] / rough[name] for name in found if rough[name] > 0]
    factor = float(np.median(ratios)) if ratios else 1.0
    noise = {name: found.get(name, factor * rough[name]) for name in motions}
    known = [value for value in noise.values() if value > 0]  # nan of joints without a sample that a fit may use
    if not known:
        raise SettingsError("plan: no joint of the result has a torque whose noise is known; expected a longer log")
    return {name: value if value > 0 else float(np.median(known)) for name, value in noise.items()}


def gravity(robot: Robot, held: str) -> Array:
    """Return gravity in coordinates of the base [m/s^2], shape (3,); a floating base has the axis `held` up."""
    if held not in UP:
        raise SettingsError(f"plan: held is '{held}'; expected an axis of the base, one of {', '.join(UP)}")
    if robot.base == "fixed":
        return robot.gravity
    axis = np.eye(3)["xyz".index(held[-1])] * (-1 if held[0] == "-" else 1)
    return np.asarray(-np.linalg.norm(robot.gravity) * axis)


def posture_of(robot: Robot, result: Result) -> Array:
    """Return the middle of where joints were in the log [rad], [m], shape (n,), within their limits; 0 if not known."""
    low, high = robot.position_limits
    middle = np.zeros(len(robot.joint_names))
    for k, name in enumerate(robot.joint_names):
        joint = result.joints.get(name)
        if joint is not None and joint.position_range is not None:
            middle[k] = np.mean(joint.position_range)
    return np.clip(middle, low, high)


def reach_of(robot: Robot, column: int, joint: JointResult, middle: float) -> Reach:
    """Return how a joint may move: shares of the model's limits; where it has none, the usual, or what the log had."""
    prismatic = robot.prismatic[column]
    low, high = (limits[column] for limits in robot.position_limits)
    if np.isfinite(low) and np.isfinite(high):
        slack = (1 - POSITION_SHARE) / 2 * (high - low)
        low, high = low + slack, high - slack
    else:
        seen = joint.position_range or (middle, middle)
        low, high = (min(seen[0], middle - USUAL_RANGE[prismatic]), max(seen[1], middle + USUAL_RANGE[prismatic]))
    usual = max(USUAL_SPEED[prismatic], FASTER * np.abs(joint.velocity_range).max())
    speed = min(SPEED_SHARE * robot.speed_limits[column], usual)
    return Reach(low=float(low), high=float(high), speed=float(speed))


def _how(robot: Robot, column: int) -> dict[str, str]:
    """Return how a walker does a motion, by its name, "" for a robot without feet."""
    foot = next((name for name in robot.contacts if robot.standing((name,))[column]), None)
    if foot is None:
        return {}
    tree = robot.tree
    direction = np.abs(tree.axes[int(np.flatnonzero(tree.columns == column)[0])].direction)
    steps = ("sideways steps", "longer or higher steps", "turning steps")[int(np.argmax(direction))]
    in_the_air = f" with {foot} in the air"
    return {
        **dict.fromkeys(("slow", "fast", "slow to fast", "turning often"), in_the_air),
        "the present motion twice as fast": f", as by {steps}",
        "the present motion half as fast": ", as by slower steps",
    }


def _notes(result: Result, chosen: Sequence[str]) -> list[str]:
    guessed = [name for name in chosen if not result.joints[name].curve]
    if not guessed:
        return []
    return [f"of {', '.join(guessed)} nothing is known: friction as of the other joints in the middle is assumed"]
