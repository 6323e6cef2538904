"""Draft of a first robot file: one function per question that a model or a log answers."""

import os
from contextlib import suppress
from pathlib import Path

import numpy as np

from stribeck.check.audit.positions import in_millimeters
from stribeck.check.init import columns
from stribeck.check.init.by_dynamics import answer_by_dynamics, write_scale, write_units_as_scales
from stribeck.check.init.draft import Draft, ask_for_ankles, ask_for_torque_source, write_contacts
from stribeck.check.init.joints import match_joints
from stribeck.check.init.model import read_model
from stribeck.check.init.names import QUESTIONS
from stribeck.check.init.search import unexplained
from stribeck.core.base.threads import one_blas_thread
from stribeck.core.base.toml import in_toml
from stribeck.core.base.typing import TorqueSource
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.errors import LogError, listed
from stribeck.core.log import RobotLog
from stribeck.core.log.channels import VECTOR_CHANNELS, WRENCH
from stribeck.core.log.clock import TIME, mean_step
from stribeck.core.log.plausibility import position_slopes
from stribeck.core.robot import Robot, model_path
from stribeck.core.robot.packages import PREFIX
from stribeck.core.robot.scale_setting import scale_setting
from stribeck.core.settings import LogTable
from stribeck.io import Recording, name_motors, open_log, word_size


def draft_robot_file(model: str, log: Path | None, output: Path) -> Draft:
    """Draft the robot file of a model and, if given, its log.

    Parameters
    ----------
    model
        Path of a model file, or `package:NAME`.
    log
        Path of a log of the robot.
    output
        Path of the robot file; the path of the model is relative to it.

    Raises
    ------
    RobotFileError
        If the model cannot be read.
    LogError
        If the log cannot be opened.
    """
    path = model_path(model, Path())
    facts = read_model(path)
    relative = os.path.relpath(path.resolve(), output.resolve().parent)
    name = model if model.startswith(PREFIX) else Path(relative).as_posix()
    draft = Draft(facts, output, {"robot": {"model": name, "base": facts.base}})
    draft.note("robot.base", f"{facts.evidence}.")
    if loose := [joint for joint in facts.range if joint not in facts.joints]:
        draft.document["robot"]["locked"] = dict.fromkeys(loose, 0.0)
        draft.note("robot.locked", f"free and planar joints are locked: {', '.join(loose)}.")
    ask_for_ankles(draft)
    with one_blas_thread(), np.errstate(all="ignore"):  # a log may contain anything
        if log is None:
            write_contacts(draft, ())
            ask_for_torque_source(draft)
            draft.ask("robot", "no log was given; `stribeck init MODEL LOG` finds names, units, signs and delays.")
        else:
            _answer_from_log(draft, log)
        draft.document = {key: value for key, value in draft.document.items() if value or key in draft.notes}
        draft.warnings += draft.robot().warnings  # refuse now what `identify` would refuse
    return draft


def _answer_from_log(draft: Draft, log: Path) -> None:
    """Answer questions from a log: names, units, roles, contacts, and order and signs by dynamics."""
    source, torque_source = _find_channels(draft, log)
    placeholder = _find_time_unit(draft, source)
    complete = _ask_for_channels(draft, source, torque_source)
    unsure = match_joints(draft, source) if complete else None
    _decide_base(draft, source)
    _write_torque_source(draft, source, torque_source)
    if unsure is None or placeholder:
        return
    write_units_as_scales(draft)
    robot = draft.robot()
    try:
        read = draft.read(source)
        if not np.isfinite(read.position).any(axis=0).all():
            prepare(read, robot, robot.settings)  # raises an error that describes the problem
    except LogError as error:
        draft.ask("log", f"the log cannot be used with these settings: {error}.")
        return
    _write_idle_joints(draft, read)
    if order := columns.orientation_order(read):
        draft.set("log.base_orientation", "order", order, "with this order the base is upright.")
    if turn := columns.servo_ticks(read):
        _write_ticks(draft, read, turn)
    lengths = in_millimeters(robot, np.nanmin(read.position, axis=0), np.nanmax(read.position, axis=0))
    for channel in ("position", "velocity"):
        if lengths.any() and getattr(read, channel) is not None:
            write_scale(draft, channel, np.where(lengths, 1e-3, 1.0))
            draft.ask(f"log.{channel}.scale", QUESTIONS["millimeters"])
    timed = "time" in source.channels
    units, why, sure = columns.position_and_velocity_units(read, robot) if timed and not turn else ({}, "", False)
    for channel, unit in units.items():
        (draft.set if sure else draft.guess)(f"log.{channel}", "unit", unit, why)
        if channel == "position" and read.command is not None:
            draft.set("log.desired_position", "unit", unit, "as the positions.")
        if channel == "position" and unit == "deg":
            _ask_for_normalized(draft, read, robot)
    write_units_as_scales(draft)
    if not timed:
        draft.ask("log.rate", "without a rate, nothing else was checked; `stribeck inspect` checks signs and units.")
    elif read.command is None:  # order and signs of commands are those of the positions
        answer_by_dynamics(draft, _compare_imus(draft, log, source), unsure)


def _find_channels(draft: Draft, log: Path) -> tuple[Recording, TorqueSource | None]:
    """Find the arrays or columns of each channel."""
    table = draft.table("log")
    named, torque_source = columns.find_columns(source := _choose_topics(draft, log))
    for channel, entry in named.items():
        draft.note(f"log.{channel}", f"the log has {channel.replace('_', ' ')} under this name.")
        table[channel] = dict(entry)
    if named:
        source = open_log(log, LogTable.model_validate(table))
    source, _ = name_motors(source, LogTable(), draft.facts.joints)
    if not {"torque", "desired_position"} & set(source.channels) and (name := columns.find_command(source)):
        draft.set("log.desired_position", "name", name, "the log has desired positions under this name.")
        source = open_log(log, LogTable.model_validate(table))
    if "torque" not in source.channels and "desired_position" in source.channels:
        torque_source = "command"
    for channel in ("torque", "velocity"):
        if word_size(columns.numbers(source, channel)):
            draft.set(f"log.{channel}", "unwrap", True, "negative integers were stored as unsigned ones.")
    used = str(table.get("torque", {}).get("name", ""))
    of_motors = [name for name in source.others if columns.is_motor_torque(name) and name not in used]
    if of_motors and not columns.is_motor_torque(used):
        draft.ask("robot.torque_source", QUESTIONS["of_motors"].format(", ".join(of_motors)))
    return source, torque_source


def _choose_topics(draft: Draft, log: Path) -> Recording:
    """Open a log; of topics with the same signals, choose one whose frame is fixed to the root link, or the first."""
    tree, table = draft.robot().tree, draft.table("log")
    fixed = {str(frame.name) for frame in tree.model.frames if frame.parentJoint == int(tree.floating)}
    idle = set() if tree.floating else {*VECTOR_CHANNELS}  # several IMUs of an arm are not used
    while asked := (source := open_log(log, LogTable.model_validate(table))).rivals.keys() - idle:
        frames = source.rivals[channel := min(asked)]
        likely = [topic for topic, frame in frames.items() if frame.lstrip("/") in fixed] or [*frames]
        topics = ", ".join(f"{topic} (frame '{frame}')" for topic, frame in frames.items())
        why = " Its frame is fixed to the model's root link." * (len(likely) == 1)
        draft.guess(f"log.{channel}", "name", likely[0], QUESTIONS["topics"].format(channel, topics, why))
        draft.imus = likely if channel == "base_orientation" and not why else draft.imus
    return source


def _compare_imus(draft: Draft, log: Path, source: Recording) -> Recording:
    """Choose the IMU with which the model explains most of the torques, if frames do not tell which is the base's."""
    opened, left = {"": source}, dict[str, float]()
    for topic in draft.imus:
        draft.table("log.base_orientation")["name"] = topic
        with suppress(LogError):  # topics that do not overlap in time
            opened[topic] = open_log(log, LogTable.model_validate(draft.table("log")))
            left[topic] = unexplained(draft.read(opened[topic]), draft.robot())
    best = min(left, key=lambda topic: left[topic], default="")
    if best:
        shares = ", ".join(f"{share:.1%} with {topic}" for topic, share in left.items())
        draft.set("log.base_orientation", "name", best, f"the model explains the torques best: it leaves {shares}.")
    return opened[best]


def _ask_for_channels(draft: Draft, source: Recording, torque_source: TorqueSource | None) -> bool:
    """Ask for positions and torques that no name suggests; return whether both were found."""
    wanted = ("position",) if torque_source == "command" else ("position", "torque")
    missing = [name for name in wanted if name not in source.channels]
    for channel in missing:
        commands = ", or [log.desired_position] name for commands" if channel == "torque" else ""
        draft.ask("log", QUESTIONS["channel"].format(channel, listed(source.others, 40), commands))
    return not missing


def _find_time_unit(draft: Draft, source: Recording) -> bool:
    """Find the unit of time, or the rate of rows whose clock is coarse; return whether the rate is a placeholder."""
    stamps = columns.numbers(source, "time")[:, 0]
    stamps = stamps[np.isfinite(stamps)] - stamps[np.isfinite(stamps)][:1]
    if not stamps.any():
        draft.guess("log", "rate", 1000.0, QUESTIONS["time"])  # nothing is derived from this rate
        return True
    mean = mean_step(stamps, (slice(0, len(stamps)),))
    coarse = mean > 0 and np.mean(np.diff(stamps) == 0) > 0.5
    unit = source.time_unit or columns.time_unit(np.array([0.0, mean]) if coarse else stamps)
    if unit != "s" and source.time_unit is None:
        draft.set("log.time", "unit", unit, "found from the length of its steps.")
    if coarse:
        draft.guess("log", "rate", float(f"{1 / (mean * TIME[unit]):.4g}"), QUESTIONS["coarse_time"])
    return False


def _decide_base(draft: Draft, source: Recording) -> None:
    """Decide whether the base moves, and on which feet it stands."""
    facts, robot = draft.facts, draft.document["robot"]
    seen = [name for name in ("base_orientation", "contact", "foot_wrench") if name in source.channels]
    if facts.base == "floating" and not seen:
        draft.guess("robot", "base", "fixed", "is the base clamped? The log has neither its orientation nor contacts.")
    if facts.base == "fixed" and seen and facts.feet:
        draft.set("robot", "base", "floating", f"the log has {', '.join(seen)}.")
    if robot["base"] == "fixed":
        given = robot.get("position_controlled", [])
        if wheels := [name for name in facts.wheels if name not in {*given, *robot.get("locked", {})}]:
            why = "wheels on the ground, with unknown forces; remove them from this list if the robot is jacked up."
            draft.set("robot", "position_controlled", [*given, *wheels], why)
        return
    labels: tuple[str, ...] = ()
    for name, width in (("contact", 1), ("foot_wrench", len(WRENCH))):
        if name in source.channels:
            given = source.channels[name].labels
            feet = tuple(dict.fromkeys(label.rsplit(".", 1)[0] if width > 1 else label for label in given or ()))
            labels = labels or feet
            if given is None and source.channels[name].columns == width * len(facts.feet):
                names = [foot.name for foot in facts.feet]
                draft.guess("log", "foot_order", names, "the log has no foot names; is this their order?")
    write_contacts(draft, labels)
    if "base_orientation" in seen:
        draft.note("robot.base", "the log's base orientation should refer to the root link; if not, set base_frame.")


def _write_torque_source(draft: Draft, source: Recording, by_name: TorqueSource | None) -> None:
    """Write the source of the torques."""
    if by_name == "motor_current":
        draft.ask("log.torque", f"are the motors' currents in {draft.document['log']['torque']['unit']}?")
    if by_name == "command" and "torque" not in source.channels:
        draft.set("robot", "torque_source", by_name, "the log has desired positions and no torques.")
        draft.ask("robot.torque_source", QUESTIONS["gains"])
    elif source.torque_source:
        draft.set("robot", "torque_source", source.torque_source, "stated in the log.")
    elif by_name:
        draft.set("robot", "torque_source", by_name, "found from the name of the log's torques.")
    else:
        ask_for_torque_source(draft)


def _write_ticks(draft: Draft, log: RobotLog, turn: int) -> None:
    """Write the scale and the zero of positions that are a servo's ticks, and the scale of its velocity."""
    scale = 2 * np.pi / turn
    draft.set("log.position", "scale", float(f"{scale:.9g}"), f"the positions are integers, as {turn} ticks per turn.")
    draft.set("log.position", "offset", -round(float(np.pi), 9), "half a turn.")
    draft.ask("log.position", f"does a turn have {turn} ticks, and is zero at {turn // 2}? Check one posture.")
    if log.velocity is not None and np.isfinite(slopes := position_slopes(log)).any():
        why = "with this scale the velocities agree with the positions."
        draft.set("log.velocity", "scale", float(f"{scale * np.nanmedian(slopes):.4g}"), why)


def _ask_for_normalized(draft: Draft, log: RobotLog, robot: Robot) -> None:
    """Ask whether degrees may be LeRobot's shares of each joint's range, and offer the keys for these.

    -100 and 100 mean the model's limits; a gripper has shares from 0 to 100.
    """
    low, high = robot.position_limits
    lowest, highest = np.nanmin(log.position, axis=0), np.nanmax(log.position, axis=0)
    gripper = np.array(["gripper" in name.lower() for name in robot.joint_names])
    beyond = np.maximum(-lowest, highest).max() > 100.5 or (lowest < -0.5)[gripper].any()
    if beyond or not np.isfinite(high - low).all():
        return
    low = np.where(gripper, 2 * low - high, low)
    keys = [dict(zip(robot.joint_names, x.tolist(), strict=True)) for x in ((high - low) / 200, (high + low) / 2)]
    settings = [scale_setting(draft.robot(), values, "position", digits=6) for values in keys]
    scale, offset = (in_toml(setting.value, len(low)) for setting in settings)
    draft.ask("log.position.unit", QUESTIONS["normalized"].format(scale, offset))


def _write_idle_joints(draft: Draft, log: RobotLog) -> None:
    """Write the joints whose torque is always zero."""
    given = draft.document["robot"].get("position_controlled", [])
    zero = ~np.any(np.nan_to_num(log.torque), axis=0)
    if idle := [name for name, none in zip(log.joint_names, zero.tolist(), strict=True) if none and name not in given]:
        draft.set("robot", "position_controlled", [*given, *idle], "their torque is always zero in the log.")
