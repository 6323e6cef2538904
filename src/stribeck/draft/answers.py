"""Draft a first robot file: one function for each question that a model or a log answers, in the order of asking."""

import os
import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from stribeck.audit import delays, findings, gather, torques_of_currents
from stribeck.draft.columns import find_columns
from stribeck.draft.draft import Draft, ask_for_torque_source, write_contacts
from stribeck.draft.model import read_model
from stribeck.draft.names import Matches, match, words
from stribeck.draft.search import Columns, as_given, find_columns_by_dynamics
from stribeck.draft.units import orientation_order, position_and_velocity_units, time_unit
from stribeck.errors import LogError, SettingsError, errors_about
from stribeck.finding import Finding
from stribeck.log import RobotLog
from stribeck.log.readers import read_log
from stribeck.log.readers.read import open_log
from stribeck.log.readers.source import JOINT_CHANNELS, WRENCH, Source, listed
from stribeck.log.readers.unitree import name_motors
from stribeck.preparation import prepare
from stribeck.robot import Robot, model_path
from stribeck.robot.packages import PREFIX
from stribeck.settings import LogTable
from stribeck.threads import one_blas_thread
from stribeck.typing import TorqueSource

HANDS = {"finger", "gripper", "hand", "thumb", "jaw", "claw", "wheel", "mimic"}
"""Joint-name keywords for parts that logs often omit."""


def draft_robot_file(model: str, log: Path | None, output: Path) -> Draft:
    """Draft the robot file of a model and, if there is one, its log.

    Parameters
    ----------
    model
        A model file, or `package:NAME`.
    log
        A log of the robot.
    output
        Where the robot file will lie, to which the model's path is relative.

    Raises
    ------
    RobotFileError
        If the model cannot be read.
    LogError
        If the log cannot be read, or contains no positions or torques.
    """
    path = model_path(model, Path())
    facts = read_model(path)
    relative = Path(os.path.relpath(path.resolve(), output.resolve().parent)).as_posix()
    name = model if model.startswith(PREFIX) else relative
    draft = Draft(facts, output, {"robot": {"model": name, "base": facts.base}})
    draft.note("robot.base", f"{facts.evidence}.")
    with one_blas_thread():
        if log is None:
            write_contacts(draft, ())
            ask_for_torque_source(draft)
            draft.ask("robot", "no log was given; `stribeck init MODEL LOG` finds names, units, signs and delays.")
        else:
            _answer_from_log(draft, log)
        draft.robot()  # refused now what `identify` would refuse
    return draft


def _answer_from_log(draft: Draft, log: Path) -> None:
    """Write what a log says, question by question: names, units, roles, contacts, and by dynamics order and signs."""
    source, torque_source = _channels(draft, log)
    _time(draft, source)
    unsure = _joints(draft, source)
    _base(draft, source)
    _torque_source(draft, source, torque_source)
    robot = draft.robot()
    read = read_log(log, robot)
    step = float(np.median(np.diff(read.time)))
    if not step > 0 or not np.isfinite(read.position).any(axis=0).all():
        prepare(read, robot, robot.settings)  # whose error says what is wrong
    _without_torque(draft, read)
    if order := orientation_order(read):
        draft.set("log.base_orientation", "order", order, "so the base is upright.")
    for channel, unit, why in position_and_velocity_units(read, robot):
        draft.set(f"log.{channel}", "unit", unit, why)
    _by_dynamics(draft, log, unsure)
    draft.document = {key: value for key, value in draft.document.items() if value}


def _channels(draft: Draft, log: Path) -> tuple[Source, TorqueSource | None]:
    """Find which arrays or columns contain what."""
    table = draft.table("log")
    named, torque_source = find_columns(open_log(log, LogTable()))
    for channel, found in named.items():
        draft.note(f"log.{channel}", f"the log holds {channel.replace('_', ' ')} under this name.")
        table[channel] = dict(found)
    source, _ = name_motors(open_log(log, LogTable.model_validate(table)), LogTable(), draft.facts.joints)
    for channel in ("position", "torque"):
        if channel not in source.channels:
            commands = ", or desired positions with [robot] kp and kd" if channel == "torque" else ""
            raise LogError(
                f"{log}: holds nothing that is called like joint {channel}s; expected '{channel}', or another name "
                f"that [log.{channel}] name says{commands} (found {listed([*source.channels, *source.others])})"
            )
    return source, torque_source


def _time(draft: Draft, source: Source) -> None:
    """Find the unit of time."""
    if "time" not in source.channels:
        draft.table("log")["rate"] = 1000.0  # [Hz], a guess
        draft.ask("log.rate", "the log holds no time; how many samples are there in a second?")
    elif source.time_unit is None:
        unit = time_unit(np.asarray(source.load({"time": [0]}).arrays["time"], dtype=float).reshape(-1))
        if unit != "s":
            draft.set("log.time", "unit", unit, "by the length of its steps.")


def _joints(draft: Draft, source: Source) -> list[str]:
    """Match columns with joints, and lock the others; return the joints that are not known by name."""
    facts, robot = draft.facts, draft.document["robot"]
    position, torque = source.channels["position"], source.channels["torque"]
    names, unsure = _unnamed(draft, position.columns) if position.labels is None else _named(draft, source)
    locked = {}
    for joint in facts.joints:
        low, high = facts.range[joint]
        if joint not in names:
            locked[joint] = float(np.clip(0.0, low, high)) if low <= high else 0.0
    if locked:
        robot["locked"] = locked
        draft.ask("robot.locked", "the log leaves these joints out; where are they held [rad or m]?")
    if torque.labels is not None and position.labels is not None:
        table = draft.table("log").get("joint_names", {})
        measured = {table.get(label, label) for label in torque.labels}
        if idle := [joint for joint in names if joint not in measured]:
            draft.set("robot", "position_controlled", idle, "the log has no torque of these.")
    return unsure


def _named(draft: Draft, source: Source) -> tuple[list[str], list[str]]:
    """Match the log's joint names; return the model's joints that the log has, and the unsure ones."""
    joints = draft.facts.joints
    renamed: dict[str, str] = {}
    names: list[str] = []
    unsure: list[str] = []
    for channel in JOINT_CHANNELS:
        labels = source.channels[channel].labels if channel in source.channels else None
        if labels is None:
            continue
        found = match(labels, joints)
        counted = [words(label) for label in labels] == [[str(k)] for k in range(len(labels))]
        if counted and labels[0] in found.left_of_log and _as_many(joints, labels):
            found = Matches({}, labels, joints)  # the model's numbers begin with one, and the log's with zero
        rest = _as_many(found.left_of_model, found.left_of_log)
        by_order = dict(zip(found.left_of_log, rest, strict=True)) if rest else {}
        pairs = found.pairs | by_order
        renamed |= {label: joint for label, joint in pairs.items() if label != joint}
        if channel != "position":
            continue
        unsure = list(by_order.values())
        names = [joint for joint in joints if joint in pairs.values()]
        left = [label for label in labels if label not in pairs]
        if not names:
            raise LogError(
                f"{source.path}: has the joints {listed(labels)}, which are none of the model's {listed(joints)}; "
                "expected a log of this robot, or its joint_names"
            )
        if left and len(names) < len(joints):
            draft.ask("log", f"which joints of the model, if any, are the log's {', '.join(left)}?")
    if renamed:
        draft.set("log", "joint_names", renamed, "matched by likeness: see whether they are right.")
    if unsure:
        draft.ask("log.joint_names", f"their names say nothing; is this the order of {', '.join(unsure)}?")
    return names, unsure


def _as_many(joints: Sequence[str], labels: Sequence[str]) -> Sequence[str]:
    """Return the joints without hands, or all of them, if they are as many as the labels."""
    arms = [joint for joint in joints if not HANDS & set(words(joint))]
    return next((some for some in (arms, joints) if len(some) == len(labels)), ())


def _unnamed(draft: Draft, columns: int) -> tuple[list[str], list[str]]:
    """Take columns without names in the model's order, hands left out first."""
    joints = list(draft.facts.joints)
    arms = [joint for joint in joints if not HANDS & set(words(joint))]
    joints = (arms if columns <= len(arms) and columns < len(joints) else joints)[:columns]
    order = joints + [f"unknown_{k}" for k in range(columns - len(joints))]
    draft.table("log")["joint_order"] = order
    draft.ask("log.joint_order", "the log does not name its columns; is this their order?")
    return joints, joints


def _base(draft: Draft, source: Source) -> None:
    """Decide whether the base moves, and on which feet it stands."""
    facts, robot = draft.facts, draft.document["robot"]
    seen = [name for name in ("base_orientation", "contact", "foot_wrench") if name in source.channels]
    if facts.base == "floating" and not seen:
        robot["base"] = "fixed"
        draft.ask("robot.base", "is the base clamped? The log has neither its orientation nor contacts.")
    if facts.base == "fixed" and seen and facts.feet:
        draft.set("robot", "base", "floating", f"the log has {', '.join(seen)}.")
    if robot["base"] == "fixed":
        return
    labels: tuple[str, ...] = ()
    for name in ("contact", "foot_wrench"):
        if name in source.channels:
            given = source.channels[name].labels
            width = len(WRENCH) if name == "foot_wrench" else 1
            feet = tuple(dict.fromkeys(label.rsplit(".", 1)[0] if width > 1 else label for label in given or ()))
            labels = labels or feet
            if given is None and source.channels[name].columns == width * len(facts.feet):
                draft.table("log")["foot_order"] = [foot.name for foot in facts.feet]
                draft.ask("log.foot_order", "the log does not name its feet; is this their order?")
    write_contacts(draft, labels)
    if "base_orientation" in seen:
        draft.note(
            "robot.base", "the log's base orientation is taken as that of the model's root link ([robot] base_frame)."
        )


def _torque_source(draft: Draft, source: Source, by_name: TorqueSource | None) -> None:
    """Write where the torques come from."""
    if by_name == "motor_current":
        draft.ask("log.torque", f"are the motors' currents in {draft.document['log']['torque']['unit']}?")
    if source.torque_source:
        draft.set("robot", "torque_source", source.torque_source, "as the log says.")
    elif by_name:
        draft.set("robot", "torque_source", by_name, "by the name of the log's torques.")
    else:
        ask_for_torque_source(draft)


def _without_torque(draft: Draft, log: RobotLog) -> None:
    """Write which joints have no torque at any time."""
    given = draft.document["robot"].get("position_controlled", [])
    zero = ~np.any(np.nan_to_num(log.torque), axis=0)
    if idle := [name for name, none in zip(log.joint_names, zero.tolist(), strict=True) if none and name not in given]:
        draft.set("robot", "position_controlled", [*given, *idle], "their torque is zero throughout the log.")


def _by_dynamics(draft: Draft, log: Path, unsure: Sequence[str]) -> None:
    """Take the settings that the audit names, and the order and signs that the model explains best."""
    searched = False
    left: list[Finding] = []
    for _ in range(4):  # rounds; each one may uncover what the next one finds
        robot = draft.robot()
        if not len(robot.torque_controlled):
            draft.ask("robot.position_controlled", "the log holds no torque: is it in another file?")
            return
        try:
            read = read_log(log, robot)
            base_unknown = read.base_orientation is None and read.contact is None and read.foot_wrench is None
            if robot.base == "floating" and (not robot.contacts or base_unknown):
                draft.ask("log", "units, order and signs could not be looked at without contacts; are they right?")
                return
            (prepared,), _, _ = torques_of_currents([prepare(read, robot, robot.settings)], robot, robot.settings)
            with errors_about(str(log)):
                evidence = gather(prepared, robot, robot.settings)
        except (LogError, SettingsError) as error:
            draft.ask("robot", f"the log cannot be used so: {error}.")
            return
        left = findings(evidence, delays(evidence))
        taken = [_take_setting(draft, finding) for finding in left]
        if any(taken):
            continue
        if searched or any(finding.check == "torque-unsigned" for finding in left):
            break  # a torque without a sign says nothing of signs
        searched = True
        columns = [robot.joint_names.index(joint) for joint in unsure]
        if not _write_columns(draft, robot, find_columns_by_dynamics(read, robot, columns)[0], read):
            break
    for finding in left:
        draft.ask("robot", f"{finding.text}; {finding.cure}." if finding.cure else f"{finding.text}.")


def _take_setting(draft: Draft, finding: Finding) -> bool:
    """Take the setting that a finding of the audit names; return whether there was one that is not there yet.

    Signs and order are found by what fits instead, and a gear or a zero is asked for.
    """
    if finding.check in ("torque-sign", "joints-swapped", "torque-gain", "position-limits"):
        return False
    found = re.match(r"set \[([a-z._]+)\] (\w+ = (?:\{[^}]*\}|\[[^\]]*\]|\S+))", finding.cure)
    if found is None or "..." in found[2]:
        return False
    try:
        ((key, value),) = tomllib.loads(found[2]).items()
    except tomllib.TOMLDecodeError:  # a joint's name may have any sign
        return False
    if finding.check == "torque-scale" and isinstance(value, dict) and isinstance(value.get("scale"), dict):
        return False  # factors of each joint's own may be gears, or a wrong order: it is asked
    table = draft.table(found[1])
    new = {**table.get(key, {}), **value} if isinstance(value, dict) else value
    if table.get(key) == new:
        return False
    draft.set(found[1], key, new, f"{finding.text}.")
    return True


def _write_columns(draft: Draft, robot: Robot, columns: Columns, log: RobotLog) -> bool:
    """Write the order and the signs that were found; return whether they differ from those that are there."""
    table = draft.table("log")
    changed = columns.order != as_given(len(robot.joint_names)).order
    if changed:
        moved = {robot.joint_names[column]: name for column, name in zip(columns.order, robot.joint_names, strict=True)}
        why = "in this order the model explains the torques far better than in its own."
        if "joint_order" in table:
            draft.set("log", "joint_order", [moved.get(name, name) for name in table["joint_order"]], why)
        else:
            names = {label: moved.get(joint, joint) for label, joint in table.get("joint_names", {}).items()}
            draft.set("log", "joint_names", names, why)
    channels = {"position": columns.position, "torque": columns.torque}
    if log.velocity is not None:
        channels["velocity"] = columns.position
    for channel, signs in channels.items():
        if np.any(signs != 1):
            changed = True
            why = "with these signs the model explains the log, and not with others."
            draft.set(f"log.{channel}", "scale", _scale(robot, table, channel, signs.tolist()), why)
    return changed


def _scale(robot: Robot, table: dict[str, Any], channel: str, signs: list[float]) -> float | dict[str, float]:
    """Return the scale of a channel times signs: one number, or by the log's names."""
    present, asked = table.get(channel, {}).get("scale", 1.0), table.get(channel, {}).get("name")
    if not isinstance(present, dict) and set(signs) == {-1.0}:
        return -float(present)
    logged = {
        joint: label
        for label, joint in table.get("joint_names", {}).items()
        if not isinstance(asked, list) or label in asked  # of the channel's own columns
    }
    scales = {
        joint: sign * (present.get(joint, 1.0) if isinstance(present, dict) else float(present))
        for joint, sign in zip(robot.joint_names, signs, strict=True)
    }
    return {logged.get(joint, joint): scale for joint, scale in scales.items() if scale != 1}
