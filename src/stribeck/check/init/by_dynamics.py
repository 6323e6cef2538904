"""Settings found with the model's dynamics: the audit's findings, and order and signs of a log's columns."""

from collections.abc import Sequence

import numpy as np

from stribeck.check.audit import audit
from stribeck.check.audit.change import ColumnChange
from stribeck.check.drives import find_torques
from stribeck.check.init.draft import Draft
from stribeck.check.init.names import QUESTIONS
from stribeck.check.init.search import find_columns_by_dynamics, gear_ratios_by_dynamics, unit_by_dynamics
from stribeck.core.base.finding import Finding
from stribeck.core.base.typing import Array
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.errors import LogError, SettingsError, errors_about
from stribeck.core.log import RobotLog
from stribeck.core.log.channels import ANGLE, SPEED
from stribeck.core.robot import Robot
from stribeck.core.robot.scale_setting import scale_setting
from stribeck.io import Recording

ASKED = ("torque-scale", "torque-gain", "several-causes", "bodies-differ", "payload", "gravity")
"""Checks whose remedies depend on what the user knows about the robot."""


def answer_by_dynamics(draft: Draft, source: Recording, unsure: Sequence[str]) -> None:
    """Apply the settings suggested by the audit, and the order and signs that fit the model best."""
    searched, problems = False, list[Finding]()
    for _ in range(4):  # rounds; a correction may reveal further problems
        robot = draft.robot()
        if not len(robot.torque_controlled):
            draft.ask("robot.position_controlled", "the log has no torque; is it in another file?")
            return
        try:
            read = draft.read(source)
            base_unknown = read.base_orientation is None and read.contact is None and read.foot_wrench is None
            if robot.base == "floating" and (not robot.contacts or base_unknown):
                draft.ask("log", "units, order and signs could not be checked without contacts; are they right?")
                return
            (prepared,), of_gains, *_ = find_torques([prepare(read, robot, robot.settings)], robot, robot.settings)
            with errors_about(source.path):
                problems = audit(prepared, robot, robot.settings)
        except (LogError, SettingsError) as error:
            draft.ask("robot", f"the log cannot be used with these settings: {error}.")
            return
        unexplained = {*ASKED[:-1], "torque-unexplained"}  # maybe due to positions in another unit
        unit = robot.log_table.position.unit or any(finding.check in unexplained for finding in problems)
        if unit is True and (unit := unit_by_dynamics(read, robot)):
            _write_unit(draft, unit, read)
            continue
        limits = any(finding.check in ("position-degrees", "position-limits") for finding in problems)
        if (unit or limits) and (ratios := gear_ratios_by_dynamics(read, robot)):
            _write_ratios(draft, *ratios)
            continue
        if sum(_apply_settings(draft, finding) for finding in problems):
            continue
        if searched or any(finding.check in ("torque-unsigned", "legs-exchanged") for finding in problems):
            break  # a torque without a sign does not show signs, and whole legs are exchanged first
        searched = True
        columns = [robot.joint_names.index(joint) for joint in unsure]
        if not _write_columns(draft, robot, find_columns_by_dynamics(read, robot, columns), read):
            break
    unknown = prepared.log.unscaled.keys()
    for finding in (*problems, *(gain_finding for gain_finding in of_gains if unknown & set(gain_finding.joints))):
        asked = finding.stops or finding not in problems or finding.check in ASKED
        (draft.ask if asked else draft.warn)("robot", f"{finding}.")


def _write_unit(draft: Draft, unit: str, log: RobotLog) -> None:
    why = "With this unit the torques agree with the model, and in radians they do not."
    draft.guess("log.position", "unit", unit, f"is this the unit of the positions? {why}")
    if log.velocity is not None:
        draft.set("log.velocity", "unit", f"{unit}/s", "as the positions.")
    write_units_as_scales(draft)


def write_units_as_scales(draft: Draft) -> None:
    """Write units of angles as scales if the model has prismatic joints, to which a channel's unit applies as well."""
    slides, tables = np.array(draft.robot().prismatic), draft.table("log")
    for channel, factors in (("position", ANGLE), ("velocity", SPEED)) if slides.any() else ():
        if unit := tables.get(channel, {}).pop("unit", None):
            draft.notes.setdefault(f"log.{channel}.scale", []).extend(draft.notes.pop(f"log.{channel}.unit", []))
            write_scale(draft, channel, np.where(slides, 1.0, factors[unit]))


def _write_ratios(draft: Draft, ratios: Array, of_torques: Array) -> None:
    """Write the gear ratios of positions, velocities and torques that are those of the motors' shafts."""
    for channel, values in (("position", 1 / ratios), ("velocity", 1 / ratios), ("torque", of_torques)):
        if channel != "torque" and draft.table(f"log.{channel}").pop("unit", None):
            draft.notes.setdefault(f"log.{channel}.scale", []).extend(draft.notes.pop(f"log.{channel}.unit", []))
        write_scale(draft, channel, values)
    listed = ", ".join(f"{name} {ratio:g}" for name, ratio in zip(draft.robot().joint_names, ratios, strict=True))
    draft.ask("log.position.scale", QUESTIONS["ratios"].format(listed))


def _apply_settings(draft: Draft, finding: Finding) -> bool:
    """Apply the settings of a finding; return whether one is new."""
    changed = False
    for setting in finding.settings:
        if finding.check == "torque-scale" and isinstance(setting.value, dict):
            continue  # different factors per joint may be gears or a wrong order: ask
        before = draft.table(setting.table).get(setting.key, {})
        new = {**before, **setting.value} if isinstance(setting.value, dict) else setting.value
        if before != new:
            draft.set(setting.table, setting.key, new, f"{finding.text}.")
            changed = True
    return changed


def _write_columns(draft: Draft, robot: Robot, columns: ColumnChange, log: RobotLog) -> bool:
    """Write the order and signs found; return whether they changed."""
    table = draft.table("log")
    changed = columns.order != tuple(range(len(robot.joint_names)))
    if changed:
        moved = {robot.joint_names[column]: name for column, name in zip(columns.order, robot.joint_names, strict=True)}
        order = [moved.get(name, name) for name in table.get("joint_order", ())]
        names = {label: moved.get(joint, joint) for label, joint in table.get("joint_names", {}).items()}
        why = "In it the model explains the torques far better than in the log's order"
        draft.guess("log", "joint_order" if order else "joint_names", order or names, f"is this right? {why}.")
    for channel, signs in (("position", columns.position), ("torque", columns.torque), ("velocity", columns.position)):
        if getattr(log, channel) is not None and write_scale(draft, channel, signs):
            changed = True
            draft.note(f"log.{channel}.scale", "only these signs agree with the model.")
    return changed


def write_scale(draft: Draft, channel: str, factors: Array) -> bool:
    """Multiply the scale of a channel by a factor per joint, shape (n,); return whether one differs from one."""
    robot = draft.robot()
    other = {name: float(factor) for name, factor in zip(robot.joint_names, factors, strict=True) if factor != 1}
    if other:
        draft.table(f"log.{channel}")["scale"] = scale_setting(robot, other, channel, digits=5).value
    return bool(other)
