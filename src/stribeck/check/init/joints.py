"""Matching of a log's joints with the joints of a model, by name or order."""

from collections.abc import Sequence

import numpy as np

from stribeck.check.init.columns import constant_columns
from stribeck.check.init.draft import Draft
from stribeck.check.init.names import QUESTIONS, is_prefixed, match, words
from stribeck.core.errors import listed
from stribeck.core.log.channels import JOINT_CHANNELS
from stribeck.io import Recording


def match_joints(draft: Draft, source: Recording) -> list[str] | None:
    """Match columns with joints, and lock the other joints.

    Returns
    -------
    unsure
        Joints that were not matched by name; None if the log has no joint of the model.
    """
    facts, position = draft.facts, source.channels["position"]
    torque = source.channels["torque" if "torque" in source.channels else "desired_position"]
    numbers = [label for channel in (position, torque) for label in channel.labels or ()]
    counted_apart = position.labels != torque.labels and all(label.isdecimal() for label in numbers)  # q0, but tau1
    nameless = position.labels is None or counted_apart
    names, unsure, extra = _assign_in_order(draft, source) if nameless else _match(draft, source)
    if not names:
        draft.ask("log", QUESTIONS["joints"].format(listed(position.labels or ()), listed(facts.joints)))
        return None
    if missing := [joint for joint in facts.joints if joint not in names]:
        for joint in missing:
            low, high = facts.range[joint]
            draft.table("robot.locked")[joint] = float(np.clip(0.0, low, high)) if low <= high else 0.0
        draft.ask("robot.locked", f"the log lacks {', '.join(missing)}; at which positions are they locked [rad or m]?")
    if extra := extra if missing else _moving(source, extra):
        same = f" which of them are {', '.join(missing)}?" if missing else " do they move parts with a mass?"
        draft.ask("log", f"these joints of the log are not in the model and are ignored: {', '.join(extra)};{same}")
    if torque.labels is not None and not nameless:
        table = draft.table("log").get("joint_names", {})
        measured = {table.get(label, label) for label in torque.labels}
        if idle := [joint for joint in names if joint not in measured]:
            draft.set("robot", "position_controlled", idle, "the log has no torque for these joints.")
    return unsure


def _moving(source: Recording, joints: Sequence[str]) -> list[str]:
    """Find the joints of a log whose position changes; messages may have places for more motors than a robot has."""
    labels, still = source.channels["position"].labels or (), constant_columns(source, "position")
    return [joint for joint in joints if labels.index(joint) not in still]


def _match(draft: Draft, source: Recording) -> tuple[list[str], list[str], list[str]]:
    """Match the log's joint names; return the model's joints in the log, the unsure ones, and the log's others."""
    joints = draft.facts.joints
    renamed, names, unsure, extra = dict[str, str](), list[str](), list[str](), list[str]()
    for channel in JOINT_CHANNELS:
        if channel not in source.channels or (labels := source.channels[channel].labels) is None:
            continue
        pairs = match(labels, joints)
        counted = [words(label) for label in labels] == [[str(k)] for k in range(len(labels))]
        if counted and not pairs.keys() & set(labels[:1]) and _as_many(joints, labels):
            pairs = {}  # the model counts from one, the log from zero
        unmatched = [label for label in labels if label not in pairs]
        rest = _as_many([joint for joint in joints if joint not in pairs.values()], unmatched)
        by_order = dict(zip(unmatched, rest, strict=True)) if rest else {}
        pairs |= by_order
        renamed |= {label: joint for label, joint in pairs.items() if label != joint}
        if channel != "position":
            continue
        unsure = list(by_order.values())
        names = [joint for joint in joints if joint in pairs.values()]
        extra = [] if rest else unmatched
    if renamed:
        draft.table("log")["joint_names"] = renamed
    if not all(is_prefixed(joint, label) for label, joint in renamed.items() if joint not in unsure):
        draft.ask("log.joint_names", "matched by similar names; are they right?")
    if unsure:
        draft.ask("log.joint_names", f"not matched by name; is this the order of {', '.join(unsure)}?")
    return names, unsure, extra


def _as_many(joints: Sequence[str], labels: Sequence[str]) -> Sequence[str]:
    """Return the joints without hands, or all of them, if their number equals the number of labels."""
    return next((some for some in (_without_hands(joints), joints) if len(some) == len(labels)), ())


def _without_hands(joints: Sequence[str]) -> Sequence[str]:
    """Remove the joints of parts that logs often omit."""
    hands = {"finger", "gripper", "hand", "thumb", "jaw", "claw", "wheel", "mimic"}
    return [joint for joint in joints if not hands & set(words(joint))]


def _assign_in_order(draft: Draft, source: Recording) -> tuple[list[str], list[str], list[str]]:
    """Assign unnamed columns in the model's order, first without hands; columns without a torque may be grippers."""
    every, arms, columns = draft.facts.joints, _without_hands(draft.facts.joints), source.channels["position"].columns
    joints = list(arms if columns <= len(arms) and columns < len(every) else every)[:columns]
    spare, torque, question = columns - len(joints), source.channels.get("torque"), "the log has no column names"
    idle = constant_columns(source, "torque") if torque and torque.columns == columns else []
    if spare and len(idle) == spare:
        question += f", and no torque in columns {', '.join(str(column + 1) for column in idle)}, as of grippers"
    else:
        idle = list(range(len(joints), columns))
    left = iter(joints)
    order = [f"unknown_{idle.index(k)}" if k in idle else next(left) for k in range(columns)]
    draft.guess("log", "joint_order", order, f"{question}; is this their order?")
    return joints, joints, []
