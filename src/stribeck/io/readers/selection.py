"""Selection of a log's columns by joint and foot."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from stribeck.core.base.toml import in_toml
from stribeck.core.errors import LogError, listed
from stribeck.core.log.channels import COMMAND, FOOT_CHANNELS, JOINT_CHANNELS, VECTOR_CHANNELS, WRENCH, widened
from stribeck.core.settings import LogTable
from stribeck.io.readers.feet import foot_columns, places_of
from stribeck.io.readers.recording import Channel, Recording

if TYPE_CHECKING:
    from stribeck.core.robot import Robot


MOTION = ("position", "velocity", "acceleration")


@dataclass(frozen=True)
class Selection:
    """Columns to load of each channel, their names, and notes on the selection.

    Attributes
    ----------
    joint_names, foot_names
        Names in the order of the columns.
    columns
        {channel: column numbers in the file}; -1 where the file has no column for a joint.
    labels
        {channel: the log's names of all of its columns, wanted or not}, for settings that name them.
    notes
        Sentences for RobotLog.notes.
    """

    joint_names: tuple[str, ...]
    foot_names: tuple[str, ...]
    columns: dict[str, list[int]]
    labels: dict[str, tuple[str, ...]]
    notes: tuple[str, ...]


def select(source: Recording, table: LogTable, robot: Robot | None) -> Selection:
    """Select the columns of a source to load: by name if it has names, else in the configured order.

    Raises
    ------
    LogError
        If a joint of the robot, or the order of nameless columns, cannot be found in the log.
    """
    if "position" not in source.channels:
        raise _missing(source, "position", "contains no joint positions")
    notes: list[str] = []
    by_command = robot is not None and robot.command_gains is not None
    commanded = robot is not None and by_command and ("torque" not in source.channels or robot.has_kp)
    unused = ("torque",) if commanded else tuple(COMMAND) if robot else ()
    if robot and robot.base == "fixed":
        unused += tuple(name for name in VECTOR_CHANNELS if name in source.rivals)
    labels = {
        name: _labels(name, channel, source, table, robot, notes)
        for name, channel in source.channels.items()
        if name not in unused and not (robot and name in FOOT_CHANNELS and not robot.contacts)  # an arm has no feet
    }
    for name in [name for name in labels if name in source.rivals]:
        topics = [*source.rivals[name]]
        cure = f"choose one by [log.{name}] name = {in_toml(topics[0])}"
        raise LogError(f"{source.path}: topics {listed(topics)} all contain {name}; {cure}")
    at = {
        name: places_of([table.joint_names.get(label, label) for label in labels[name]], name, source.path)
        for name in JOINT_CHANNELS
        if name in labels
    }
    joints = robot.joint_names if robot else tuple(at["position"])
    columns = {"time": [0]} if "time" in source.channels and table.rate is None else {}
    for name, places in at.items():
        chosen = _joint_columns(name, places, joints, source, robot, notes)
        if chosen is not None:
            columns[name] = chosen
    if commanded and "desired_position" not in columns:
        problem = "torque_source 'command' requires torques or desired positions, and the log has none"
        raise _missing(source, "desired_position", problem)
    if "torque" not in columns and not commanded:
        columns |= _no_torque(source, joints, robot)
    columns |= _vector_columns(source, labels)
    feet, of_feet = foot_columns(labels, source, table, robot, notes)
    notes += _ignored_channels(source, labels, robot, commanded)
    notes += _ignored_joints(source, at, joints)
    return Selection(joints, feet, columns | of_feet, labels, tuple(notes))


def _labels(
    name: str, channel: Channel, source: Recording, table: LogTable, robot: Robot | None, notes: list[str]
) -> tuple[str, ...]:
    """Name every column of a channel by the log's labels, the configured order, or the robot's names."""
    if name == "time":
        return ("time",)
    feet = name in FOOT_CHANNELS
    width = len(WRENCH) if name == "foot_wrench" else 1
    setting = "foot_order" if feet else "joint_order"
    agreed = tuple(getattr(table, setting))
    keys = () if robot is None else tuple(robot.contacts) if feet else robot.joint_names
    labels = _without_numbers(name, channel.labels, {*keys, *(table.foot_names if feet else table.joint_names)}, source)
    if name in VECTOR_CHANNELS:
        return labels or VECTOR_CHANNELS[name][: channel.columns]
    asked = getattr(table, name).name
    strange = isinstance(asked, list) and not {table.joint_names.get(n, n) for n in labels or asked} & set(keys)
    if labels is not None and not (asked and agreed) and not (strange and len(keys) * width == channel.columns):
        names = labels
    elif agreed:
        names = widened(agreed, width)
    elif len(keys) * width == channel.columns:
        names = widened(keys, width)
        notes.append(
            f"The columns of '{name}' have no known names: taken in the order of the robot file ({listed(keys)})."
        )
    elif robot is None:
        names = widened(tuple(f"{'foot' if feet else 'joint'}_{i + 1}" for i in range(channel.columns // width)), width)
    else:
        raise LogError(
            f"{source.path}: '{name}' has {channel.columns} columns without names, the robot has {len(keys) * width}; "
            f"list their names in [log] {setting}, or as an array '{setting.replace('_order', '_names')}' in the log"
        )
    if len(names) != channel.columns:
        raise LogError(
            f"{source.path}: '{name}' has {channel.columns} columns, and there are {len(names)} names for them "
            f"({listed(names)}); expected one name per column"
        )
    return names


def _without_numbers(
    name: str, labels: tuple[str, ...] | None, known: set[str], source: Recording
) -> tuple[str, ...] | None:
    """Return a channel's labels, or None if they only number its columns.

    Raises
    ------
    LogError
        If they are numbers with gaps.
    """
    if not labels or known & set(labels) or not all(label.isdecimal() for label in labels):
        return labels
    first = min(1, int(labels[0]))
    if [int(label) for label in labels] != list(range(first, first + len(labels))):
        raise LogError(
            f"{source.path}: the columns of '{name}' have the numbers {listed(labels, 20)}; expected "
            f"{first}, {first + 1}, ... {first + len(labels) - 1}, each once, in the order of the joints or feet"
        )
    return None


def _vector_columns(source: Recording, labels: dict[str, tuple[str, ...]]) -> dict[str, list[int]]:
    """Find the column of each axis of the vectors."""
    columns = {}
    for name, axes in VECTOR_CHANNELS.items():
        if name in labels:
            order = labels[name]
            if sorted(order) != sorted(axes):
                raise LogError(f"{source.path}: '{name}' has columns {listed(order)}; expected {listed(axes)}")
            columns[name] = [order.index(axis) for axis in axes]
    return columns


def _joint_columns(
    name: str, places: dict[str, int], joints: Sequence[str], source: Recording, robot: Robot | None, notes: list[str]
) -> list[int] | None:
    """Find the column of each joint; None if an optional channel does not cover the robot."""
    missing = [joint for joint in joints if joint not in places]
    if robot is not None and name in MOTION:  # the passive joints of loops follow the others
        missing = [joint for joint in missing if joint not in robot.passive]
    needed = name in ("position", "torque") or (robot is not None and name == "desired_position")
    if name in ("torque", *COMMAND) and robot is not None:
        missing_torque = [joint for joint in missing if joint not in robot.position_controlled]
        filled = [joint for joint in missing if joint in robot.position_controlled]
        if filled and not missing_torque and name == "torque":
            notes.append(f"No torque of the position-controlled joints {listed(filled)}: zero is used.")
        missing = missing_torque
    if missing and needed:
        raise LogError(_missing_joint(name, missing, places, source, robot))
    if name == "external_torque" and len(missing) < len(joints):
        notes += [f"No external torque of {listed(missing)}: zero is used."] * bool(missing)
        missing = []
    if missing and name != "temperature":
        notes.append(f"'{name}' is ignored: the log has no values of {listed(missing)}.")
        return None
    return [places.get(joint, -1) for joint in joints]


def _missing_joint(
    channel: str, missing: list[str], places: dict[str, int], source: Recording, robot: Robot | None
) -> str:
    where = robot.path if robot and robot.path else "the robot file"
    known = robot.joint_names if robot else missing
    strangers = [name for name in places if name not in known]
    cure = f"list joints without {channel} in [robot] position_controlled = {in_toml(missing)}"
    if channel == "position":
        cure = f"lock joints that the log omits, as [robot] locked = {in_toml(dict.fromkeys(missing, 0.0), 10**6)}"
    if strangers and robot:
        named = dict(robot.log_table.joint_names) | _paired(strangers, missing)
        cure = f"in {where}, set joint_names = {in_toml(named, most=10**6)} in [log] and check the pairs, or {cure}"
    names = f"the log has {listed(strangers or list(places))}"
    return f"{source.path}: no {channel} of joint {listed(missing)} in the log; {names}; {cure}"


def _paired(names: Sequence[str], joints: Sequence[str]) -> dict[str, str]:
    """Pair names of a log with joints, in order if their numbers agree, otherwise with the closest name."""
    if len(names) == len(joints):
        return dict(zip(names, joints, strict=True))
    pairs: dict[str, str] = {}
    for joint in joints[: len(names)]:
        rest = [name for name in names if name not in pairs]
        pairs[difflib.get_close_matches(joint, rest, n=1, cutoff=0.0)[0]] = joint
    return pairs


def _no_torque(source: Recording, joints: Sequence[str], robot: Robot | None) -> dict[str, list[int]]:
    """Make a torque channel of zeros if every joint is position-controlled; refuse other logs without torque."""
    if robot is not None and set(joints) <= set(robot.position_controlled):
        return {"torque": [-1] * len(joints)}
    command = ", or [robot] torque_source = 'command' to use its desired positions"
    remedy = command * ("desired_position" in source.channels)
    raise _missing(source, "torque", "contains no joint torques", remedy)


def _missing(source: Recording, channel: str, problem: str, remedy: str = "") -> LogError:
    """Make the error about a missing channel of joints."""
    usual = f"an array '{channel}', columns '{channel}.<joint>' or a topic of sensor_msgs/JointState"
    return LogError(
        f"{source.path}: {problem}; expected {source.expected.get(channel) or usual}, or its name as [log.{channel}] "
        f"name{remedy} (found {listed([*source.channels, *source.others])})"
    )


def _ignored_joints(source: Recording, at: dict[str, dict[str, int]], joints: Sequence[str]) -> list[str]:
    strangers = list(dict.fromkeys(joint for places in at.values() for joint in places if joint not in joints))
    notes = [f"Joints {listed(strangers)} of the log are not joints of the robot and are ignored."] if strangers else []
    if source.others:
        notes.append(f"Ignored, because stribeck does not use it: {listed(source.others)}.")
    return notes


def _ignored_channels(
    source: Recording, labels: dict[str, tuple[str, ...]], robot: Robot | None, commanded: bool
) -> list[str]:
    """Describe the channels and settings that are not used; `commanded` is whether commands give the torques."""
    reasons = {"torque": "torques are computed from the command."}
    notes = [
        f"'{name}' is ignored: "
        + ("the robot has no contacts." if name in FOOT_CHANNELS else reasons.get(name, "several topics contain it."))
        for name in source.channels
        if name not in labels and name not in COMMAND
    ]
    if idle := [name for name in COMMAND if robot and name in source.channels and not commanded]:
        notes.append(
            f"{listed(idle)} is ignored: the log's torques are used. Set [robot] kp to compute them from the command."
        )
    if robot and robot.command_gains is not None and not commanded and robot.command_delay is not None:
        notes.append("command_delay is ignored: the log's torques are used. Set delay in [log.torque] to shift them.")
    return notes
