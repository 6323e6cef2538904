"""Plan of motions that identify the friction of weak joints."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from stribeck.core.base.text_table import TextTable
from stribeck.core.equations.friction_torque.preparation import Progress, quiet
from stribeck.core.errors import SettingsError
from stribeck.core.result import Result, read_result
from stribeck.core.robot import Robot
from stribeck.design.planning.advice import LONGEST, JointAdvice, advise
from stribeck.design.planning.collision import load_self_collision
from stribeck.design.planning.information import dynamics_of, noise_of, present_motions
from stribeck.design.planning.selection import (
    assumed_density,
    before_the_first_log,
    chosen_joints,
    gravity,
    missing_limits,
    planned_joint,
    posture_of,
)
from stribeck.design.planning.series import PERIOD, Task
from stribeck.design.planning.trajectory import Trajectory, design


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
                candidate.motion,
                (f"{candidate.slowest:.2g} to " if candidate.slowest not in (0.0, candidate.fastest) else "")
                + f"{candidate.fastest:.2g} {joint.unit}",
                str(candidate.reversals),
                f"{candidate.duration:.0f}",
                within(candidate.relative_width),
                "" if candidate.needed is None else f"{candidate.needed:.0f}",
            ]
            for name, joint in self.joints.items()
            for candidate in joint.candidates
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
        plain = asdict(self, dict_factory=lambda fields: {key: value for key, value in fields if key != "at"})
        document = {"schema": 1} | {key: plain[key] for key in ("robot", "joints", "trajectory", "notes")}
        return json.dumps(document, indent=2, allow_nan=False) + "\n"


def within(width: float) -> str:
    """Format half of an interval divided by its value."""
    return f"± {100 * width:.2g} %" if width < 1 else "unknown"


def plan(
    result: Result | str | Path | None,
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
        Result of `identify`, or the path of a result.json with its friction_torque.parquet in the same folder. None
        before the first log: only a trajectory within the model's limits is designed.
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
    first = result is None
    if result is None:
        if robot.base == "floating" and held is None:
            raise SettingsError("plan: the base moves; hold it and name its axis that points up (`--held z`)")
        result, duration = before_the_first_log(robot), duration or 60.0
    result = result if isinstance(result, Result) else read_result(result)
    chosen = chosen_joints(result, robot, joints)
    dynamics = dynamics_of(robot, gravity(robot, held or "z"), robot.settings.priors)
    if not chosen:
        return Plan(robot=result.robot, joints={}, notes=[])
    posture = posture_of(robot, result)
    planned = {name: planned_joint(name, result.joints, robot, posture) for name in result.joints}
    motions = {} if first else present_motions(result, planned)
    noise = assumed_density(robot) if first else noise_of(planned, motions)
    task, advice = Task(dynamics, [replace(planned[name], noise=noise[name]) for name in chosen], posture), {}
    for k, (name, joint) in enumerate(zip(chosen, task.joints, strict=True) if motions else ()):
        progress(f"moving {name}", 0.2 * k / len(chosen))
        advice[name] = advise(task, joint, motions[name], result.log.duration)
    guessed = ", ".join(name for name in advice if planned[name].guessed)
    notes = [f"{guessed}: no data; the median friction of the other joints is assumed"] if guessed else []
    advised = Plan(robot=result.robot, joints=advice, notes=notes)
    if duration is None:
        return advised
    if robot.base == "floating" and held is None:
        moves = "no trajectory, because the base moves; if it is held, name its axis that points up (`held`)"
        return replace(advised, notes=[*notes, moves])
    progress("searching a trajectory", 0.2)
    bodies, of_bodies = load_self_collision(robot, posture)
    limits = missing_limits(robot, chosen) if first else []
    trajectory, of_trajectory = design(task, duration, bodies, predict=not first)
    return replace(advised, notes=[*notes, *of_bodies, *limits, *of_trajectory], trajectory=trajectory)
