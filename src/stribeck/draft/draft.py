"""A first robot file: the model says what the robot is, the log how it differs, and what neither says is asked."""

import os
import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from stribeck.audit import delays, findings, gather, torques_of_currents
from stribeck.draft.columns import find_columns
from stribeck.draft.model import ModelFacts, read_model
from stribeck.draft.names import Matches, match, words
from stribeck.draft.search import Columns, agreement, as_given, excerpt, find_columns_by_dynamics
from stribeck.draft.text import write_toml
from stribeck.draft.units import orientation_order, position_and_velocity_units, time_unit
from stribeck.draft.unnamed import name_columns
from stribeck.errors import LogError, SettingsError, errors_about
from stribeck.finding import Finding
from stribeck.log import RobotLog
from stribeck.log.readers import read_log
from stribeck.log.readers.read import open_log
from stribeck.log.readers.source import JOINT_CHANNELS, WRENCH, Source, listed
from stribeck.log.readers.unitree import name_motors
from stribeck.preparation import PreparedLog, prepare
from stribeck.robot import Robot, from_robot_file, model_path
from stribeck.robot.packages import PREFIX
from stribeck.settings import LogTable, RobotFile
from stribeck.threads import one_blas_thread

UNNAMED_RATE = 1000.0
"""[Hz] that is written where a log has no time."""
HANDS = {"finger", "gripper", "hand", "thumb", "jaw", "claw", "wheel", "mimic"}
"""Words of joints that logs leave out first."""
NOT_TAKEN = ("torque-sign", "joints-swapped", "torque-gain", "position-limits")
"""Checks whose cures are not taken: signs and order are found by what fits, and a gear or a zero is asked for."""
UNCLAMPED = 0.5
"""Share of the variance of its legs' torques [1] that a clamped robot's model and friction do not leave."""
FEW_GAPS, LONGEST_BRIDGED = 20, 5.0
"""Gaps [1] that a log may have, and periods [1] that a longer one is bridged over where there are more."""
ROUNDS = 4


@dataclass
class Draft:
    """A robot file while it is written.

    Attributes
    ----------
    document
        Its tables.
    notes
        Comments by dotted key.
    questions
        What neither model nor log say, a sentence each.
    """

    document: dict[str, Any]
    notes: dict[str, list[str]] = field(default_factory=dict)
    questions: list[str] = field(default_factory=list)

    def note(self, key: str, text: str) -> None:
        """Put a comment above a key or a table."""
        self.notes.setdefault(key, []).append(text)

    def ask(self, key: str, text: str) -> None:
        """Put a question above a key or a table."""
        self.questions.append(text)
        self.note(key, f"TODO: {text}")

    @property
    def text(self) -> str:
        """The robot file."""
        heading = ["Written by `stribeck init`; every key is explained in docs/robot-file.md."]
        if self.questions:
            heading.append(f"What neither the model nor the log say is marked TODO ({len(self.questions)} of them).")
        return write_toml(self.document, self.notes, heading)

    def robot(self, path: Path) -> Robot:
        """Return the robot that the file describes if it lies at this path."""
        return from_robot_file(RobotFile.model_validate(tomllib.loads(self.text)), path)


def draft_robot_file(model: str, log: Path | None, output: Path) -> Draft:
    """Return the robot file of a model and, if there is one, its log.

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
        If the log cannot be read, or holds no positions or torques.
    """
    path = model_path(model, Path())
    facts = read_model(path)
    name = model if model.startswith(PREFIX) else _relative(path, output)
    draft = Draft({"robot": {"model": name, "base": facts.base}})
    draft.note("robot.base", f"{facts.evidence}.")
    with one_blas_thread():
        if log is None:
            _contacts(draft, facts, ())
            _ask_for_torque_source(draft)
            draft.ask("robot", "no log was given; `stribeck init MODEL LOG` finds names, units, signs and delays.")
        else:
            _of_log(draft, facts, log, output)
        draft.robot(output)  # refused now what `identify` would refuse
    return draft


def _relative(path: Path, output: Path) -> str:
    return Path(os.path.relpath(path.resolve(), output.resolve().parent)).as_posix()


def _ask_for_torque_source(draft: Draft) -> None:
    draft.document["robot"]["torque_source"] = "link_side_sensor"
    draft.ask(
        "robot.torque_source",
        'is the torque measured behind the gear ("link_side_sensor") or before it ("motor_side_sensor"), worked out '
        'from the current ("motor_current"), or what a controller asked for ("command")?',
    )


def _of_log(draft: Draft, facts: ModelFacts, log: Path, output: Path) -> None:
    """Write what a log says."""
    table: dict[str, Any] = {}
    hands = [joint for joint in facts.joints if HANDS & set(words(joint))]
    for joints in (len(facts.joints), len(facts.joints) - len(hands)):
        if names := name_columns(log, joints):
            table["columns"] = names
            draft.ask("log.columns", "the file has no line of names; are these its columns?")
            break
    named, torque_source = find_columns(open_log(log, LogTable.model_validate(table)))
    for channel, found in named.items():
        draft.note(f"log.{channel}", f"the log holds {channel.replace('_', ' ')} under this name.")
        table[channel] = dict(found)
    source, _ = name_motors(open_log(log, LogTable.model_validate(table)), LogTable(), facts.joints)
    for channel in ("position", "torque"):
        if channel not in source.channels:
            commands = ", or desired positions with [robot] kp and kd" if channel == "torque" else ""
            raise LogError(
                f"{log}: holds nothing that is called like joint {channel}s; expected '{channel}', or another name "
                f"that [log.{channel}] name says{commands} (found {listed([*source.channels, *source.others])})"
            )
    draft.document["log"] = table
    if torque_source == "motor_current":
        draft.ask("log.torque", f"are the motors' currents in {table['torque']['unit']}?")
    _time(draft, source)
    unsure = _joints(draft, facts, source)
    _base(draft, facts, source)
    if source.torque_source:
        draft.document["robot"]["torque_source"] = source.torque_source
        draft.note("robot.torque_source", "as the log says.")
    elif torque_source:
        draft.document["robot"]["torque_source"] = torque_source
        draft.note("robot.torque_source", "by the name of the log's torques.")
    else:
        _ask_for_torque_source(draft)
    robot = draft.robot(output)
    read = read_log(log, robot)
    step = float(np.median(np.diff(read.time)))
    if not step > 0 or not np.isfinite(read.position).any(axis=0).all():
        prepare(read, robot, robot.settings)  # which says what is wrong
    _idle(draft, read, robot)
    if order := orientation_order(read):
        _set(draft, "log.base_orientation", "order", order, "so the base is upright.")
    for channel, unit, why in position_and_velocity_units(read, robot):
        _set(draft, f"log.{channel}", "unit", unit, why)
    _clamped(draft, facts, log, output)
    _by_dynamics(draft, log, output, unsure)
    draft.document = {key: value for key, value in draft.document.items() if value}


def _set(draft: Draft, place: str, key: str, value: Any, why: str) -> None:
    """Set a key of a table, and say why."""
    table = draft.document
    for part in place.split("."):
        table = table.setdefault(part, {})
    table[key] = value
    draft.note(f"{place}.{key}", why)


def _time(draft: Draft, source: Source) -> None:
    table = draft.document["log"]
    if "time" not in source.channels:
        table["rate"] = UNNAMED_RATE
        draft.ask("log.rate", "the log holds no time; how many samples are there in a second?")
    elif source.time_unit is None:
        unit = time_unit(np.asarray(source.load({"time": [0]}).arrays["time"], dtype=float).reshape(-1))
        if unit != "s":
            _set(draft, "log.time", "unit", unit, "by the length of its steps.")


def _joints(draft: Draft, facts: ModelFacts, source: Source) -> list[str]:
    """Write which column is which joint, and what is locked; return the joints that are not known by name."""
    position = source.channels["position"]
    if position.labels is None:
        names, unsure = _unnamed(draft, facts, position.columns)
        absent = [joint for joint in facts.joints if joint not in names]
    else:
        names, absent, unsure = _named(draft, facts, source)
    locked = {}
    for joint in absent:
        low, high = facts.range[joint]
        locked[joint] = float(np.clip(0.0, low, high)) if low <= high else 0.0
    if locked:
        draft.document["robot"]["locked"] = locked
        draft.ask("robot.locked", "the log leaves these joints out; where are they held [rad or m]?")
    torque = source.channels["torque"]
    if torque.labels is not None and position.labels is not None:
        table = draft.document["log"].get("joint_names", {})
        measured = {table.get(label, label) for label in torque.labels}
        idle = [joint for joint in names if joint not in measured]
        if idle:
            draft.document["robot"]["position_controlled"] = idle
            draft.note("robot.position_controlled", "the log has no torque of these.")
    return unsure


def _named(draft: Draft, facts: ModelFacts, source: Source) -> tuple[list[str], list[str], list[str]]:
    """Match the log's joint names; return the model's that the log has, those that it has not, and the unsure ones."""
    renamed: dict[str, str] = {}
    names: list[str] = []
    absent: list[str] = []
    unsure: list[str] = []
    for channel in JOINT_CHANNELS:
        labels = source.channels[channel].labels if channel in source.channels else None
        if labels is None:
            continue
        found = match(labels, facts.joints)
        counted = [words(label) for label in labels] == [[str(k)] for k in range(len(labels))]
        if counted and labels[0] in found.left_of_log and _as_many(facts.joints, labels):
            found = Matches({}, labels, facts.joints)  # the model's numbers begin with one, and the log's with zero
        pairs = dict(found.pairs)
        if rest := _as_many(found.left_of_model, found.left_of_log):
            by_order = dict(zip(found.left_of_log, rest, strict=True))
            pairs |= by_order
            if channel == "position":
                unsure = list(by_order.values())
        renamed |= {label: joint for label, joint in pairs.items() if label != joint}
        if channel == "position":
            names = [joint for joint in facts.joints if joint in pairs.values()]
            absent = [joint for joint in facts.joints if joint not in pairs.values()]
            left = [label for label in labels if label not in pairs]
            if not names:
                raise LogError(
                    f"{source.path}: has the joints {listed(labels)}, which are none of the model's "
                    f"{listed(facts.joints)}; expected a log of this robot, or its joint_names"
                )
            if left and absent:
                draft.ask("log", f"which joints of the model, if any, are the log's {', '.join(left)}?")
    if renamed:
        draft.document["log"]["joint_names"] = renamed
        draft.note("log.joint_names", "matched by likeness: see whether they are right.")
    if unsure:
        draft.ask("log.joint_names", f"their names say nothing; is this the order of {', '.join(unsure)}?")
    return names, absent, unsure


def _as_many(joints: Sequence[str], labels: Sequence[str]) -> Sequence[str]:
    """Return the joints without hands, or all of them, if they are as many as the labels."""
    arms = [joint for joint in joints if not HANDS & set(words(joint))]
    return next((some for some in (arms, joints) if len(some) == len(labels)), ())


def _unnamed(draft: Draft, facts: ModelFacts, columns: int) -> tuple[list[str], list[str]]:
    """Take columns without names in the model's order, hands left out first."""
    joints = list(facts.joints)
    if columns < len(joints):
        joints = [joint for joint in joints if not HANDS & set(words(joint))]
        joints = joints[:columns] if len(joints) >= columns else list(facts.joints)[:columns]
    order = joints + [f"unknown_{k}" for k in range(columns - len(joints))]
    draft.document["log"]["joint_order"] = order
    draft.ask("log.joint_order", "the log does not name its columns; is this their order?")
    return joints, joints


def _base(draft: Draft, facts: ModelFacts, source: Source) -> None:
    """Write whether the base moves, as the log has it, and its contacts."""
    seen = [name for name in ("base_orientation", "contact", "foot_wrench") if name in source.channels]
    robot = draft.document["robot"]
    if facts.base == "floating" and not seen:
        robot["base"] = "fixed"
        draft.ask("robot.base", "is the base clamped? The log has neither its orientation nor contacts.")
    if facts.base == "fixed" and seen and facts.feet:
        robot["base"] = "floating"
        draft.note("robot.base", f"the log has {', '.join(seen)}.")
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
                draft.document["log"]["foot_order"] = [foot.name for foot in facts.feet]
                draft.ask("log.foot_order", "the log does not name its feet; is this their order?")
    _contacts(draft, facts, labels)
    if "base_orientation" in seen:
        draft.note(
            "robot.base", "the log's base orientation is taken as that of the model's root link ([robot] base_frame)."
        )


def _clamped(draft: Draft, facts: ModelFacts, log: Path, output: Path) -> None:
    """Let a robot with soles stand that was taken to be clamped, if that does not explain the torques of its legs."""
    if not facts.feet or draft.document["robot"]["base"] == facts.base or any(f.kind == "point" for f in facts.feet):
        return
    standing = Draft({**draft.document, "robot": {**draft.document["robot"], "base": "floating"}})
    _contacts(standing, facts, ())
    robot, other = draft.robot(output), standing.robot(output)
    legs = other.standing(tuple(other.contacts))[robot.torque_controlled]
    left = agreement(excerpt(read_log(log, robot)), robot).left[legs]
    if np.isfinite(left).any() and np.nanmedian(left) > UNCLAMPED:
        draft.document = standing.document
        draft.note("robot.base", "the torques of its legs are not those of a robot that hangs.")


def _contacts(draft: Draft, facts: ModelFacts, labels: Sequence[str]) -> None:
    """Write the feet, by the log's names if it has some."""
    if draft.document["robot"]["base"] == "fixed":
        return
    names = {foot: label for label, foot in match(labels, [foot.name for foot in facts.feet]).pairs.items()}
    topics = {label: foot for foot, label in names.items() if label.startswith("/")}
    if topics:
        draft.document.setdefault("log", {})["foot_names"] = topics
    contacts = {}
    for foot in facts.feet:
        name = foot.name if foot.name in topics.values() else names.get(foot.name, foot.name)
        contacts[name] = {"frame": foot.frame, "kind": foot.kind}
        if foot.name in facts.tilted:
            draft.ask(f"contacts.{name}", "does the z axis of this frame point up when the sole lies flat?")
    draft.document["contacts"] = contacts
    unknown = [label for label in labels if label not in names.values()]
    if unknown and len(names) < len(facts.feet):
        draft.ask("robot.base", f"which contacts are the log's {', '.join(unknown)}? Name them in [log.foot_names].")
    if not contacts:
        draft.ask("robot.base", "which frames of the model are feet? Add [contacts.<foot>] frame and kind.")


def _idle(draft: Draft, log: RobotLog, robot: Robot) -> None:
    """Write which joints have no torque at any time."""
    given = draft.document["robot"].get("position_controlled", [])
    zero = ~np.any(np.nan_to_num(log.torque), axis=0)
    idle = [name for name, none in zip(robot.joint_names, zero.tolist(), strict=True) if none and name not in given]
    if idle:
        draft.document["robot"]["position_controlled"] = [*given, *idle]
        draft.note("robot.position_controlled", "their torque is zero throughout the log.")


def _by_dynamics(draft: Draft, log: Path, output: Path, unsure: Sequence[str]) -> None:
    """Take the audit's cures, and find order and signs, until both have nothing more to say."""
    searched = False
    left: list[Finding] = []
    for _ in range(ROUNDS):
        robot = draft.robot(output)
        if not len(robot.torque_controlled):
            draft.ask("robot.position_controlled", "the log holds no torque: is it in another file?")
            return
        try:
            read = read_log(log, robot)
            if robot.base == "floating" and (not robot.contacts or _base_unknown(read)):
                draft.ask("log", "units, order and signs could not be looked at without contacts; are they right?")
                return
            (prepared,), _, _ = torques_of_currents([prepare(read, robot, robot.settings)], robot, robot.settings)
            if _bridge(draft, prepared, read):
                continue
            with errors_about(str(log)):
                evidence = gather(prepared, robot, robot.settings)
        except (LogError, SettingsError) as error:
            draft.ask("robot", f"the log cannot be used so: {error}.")
            return
        left = findings(evidence, delays(evidence))
        cured = [_cure(draft, finding) for finding in left]
        if any(cured):
            continue
        if searched or any(finding.check == "torque-unsigned" for finding in left):
            break  # a torque without a sign says nothing of signs
        searched = True
        columns = [robot.joint_names.index(joint) for joint in unsure]
        if not _write_columns(draft, robot, find_columns_by_dynamics(read, robot, columns)[0], read):
            break
    for finding in left:
        draft.ask("robot", f"{finding.text}; {finding.cure}." if finding.cure else f"{finding.text}.")


def _base_unknown(log: RobotLog) -> bool:
    return log.base_orientation is None and log.contact is None and log.foot_wrench is None


def _bridge(draft: Draft, prepared: PreparedLog, log: RobotLog) -> bool:
    """Let steps that are a little too long be interpolated where they are many; return whether they are."""
    sampling, table = prepared.sampling, draft.document["log"]
    if "max_gap" in table or len(sampling.gaps) < FEW_GAPS:
        return False
    longest = LONGEST_BRIDGED * sampling.period
    steps = np.diff(log.time)
    gap = float(np.ceil(100 * 1.05 * steps[steps < longest].max()) / 100)
    _set(draft, "log", "max_gap", gap, f"{len(sampling.gaps)} steps are longer than others; these are bridged.")
    return True


def _cure(draft: Draft, finding: Finding) -> bool:
    """Take the setting that a finding of the audit names; return whether there was one that is not there yet."""
    if finding.check in NOT_TAKEN:
        return False
    found = re.match(r"set \[([a-z._]+)\] (\w+ = (?:\{[^}]*\}|\[[^\]]*\]|\S+))", finding.cure)
    if found is None or "..." in found[2]:
        return False
    try:
        value = tomllib.loads(found[2])
    except tomllib.TOMLDecodeError:  # a joint's name may have any sign
        return False
    each = next(iter(value.values()))
    if finding.check == "torque-scale" and isinstance(next(iter(each.values()), None), dict):
        return False  # factors of each joint's own may be gears, or a wrong order: it is asked
    table = draft.document
    for part in found[1].split("."):
        table = table.setdefault(part, {})
    if all(table.get(key) == one or _within(one, table.get(key)) for key, one in value.items()):
        return False
    for key, one in value.items():
        table[key] = {**table.get(key, {}), **one} if isinstance(one, dict) else one
        draft.note(f"{found[1]}.{key}", f"{finding.text}.")
    return True


def _within(one: Any, other: Any) -> bool:
    return isinstance(one, dict) and isinstance(other, dict) and one.items() <= other.items()


def _write_columns(draft: Draft, robot: Robot, columns: Columns, log: RobotLog) -> bool:
    """Write the order and the signs that were found; return whether they differ from those that are there."""
    given = as_given(len(robot.joint_names))
    table = draft.document["log"]
    changed = False
    if columns.order != given.order:
        changed = True
        moved = {robot.joint_names[column]: name for column, name in zip(columns.order, robot.joint_names, strict=True)}
        if "joint_order" in table:
            table["joint_order"] = [moved.get(name, name) for name in table["joint_order"]]
        else:
            names = table.setdefault("joint_names", {})
            table["joint_names"] = {label: moved.get(joint, joint) for label, joint in names.items()}
        key = "joint_order" if "joint_order" in table else "joint_names"
        draft.note(f"log.{key}", "in this order the model explains the torques far better than in its own.")
    channels = {"position": columns.position, "torque": columns.torque}
    if log.velocity is not None:
        channels["velocity"] = columns.position
    for channel, signs in channels.items():
        if np.all(signs == 1):
            continue
        changed = True
        place = table.setdefault(channel, {})
        if np.all(signs == -1):
            place["scale"] = -_number(place.get("scale", 1.0))
        else:
            place["scale"] = _signs(robot, table, channel, signs, place.get("scale", 1.0))
        draft.note(f"log.{channel}.scale", "with these signs the model explains the log, and not with others.")
    return changed


def _number(scale: Any) -> Any:
    return scale if isinstance(scale, float | int) else 1.0


def _signs(robot: Robot, table: dict[str, Any], channel: str, signs: Any, present: Any) -> dict[str, float]:
    """Return the scale by the log's names."""
    logged = {joint: label for label, joint in table.get("joint_names", {}).items() if _is_of(table, channel, label)}
    scales = {}
    for joint, sign in zip(robot.joint_names, signs.tolist(), strict=True):
        scale = sign * (present.get(joint, 1.0) if isinstance(present, dict) else float(present))
        if scale != 1:
            scales[logged.get(joint, joint)] = scale
    return scales


def _is_of(table: dict[str, Any], channel: str, label: str) -> bool:
    """Return whether a label is of a channel's own columns, where each channel has a list of them."""
    asked = table.get(channel, {}).get("name")
    return not isinstance(asked, list) or label in asked
