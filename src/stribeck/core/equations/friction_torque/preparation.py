"""Preparation of a log: reading, even sampling, and support phases."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

from stribeck.core.base.parts import SERVICES
from stribeck.core.base.spans import spans_of_log
from stribeck.core.dynamics.attitude import with_gyroscope
from stribeck.core.dynamics.contact import SupportPhases, find_support_phases
from stribeck.core.dynamics.loops import closed_log
from stribeck.core.equations.friction_torque.payload import changes_of_payload, with_payloads
from stribeck.core.errors import LogError, RobotFileError, errors_about, findings_kept
from stribeck.core.filters import make_filter
from stribeck.core.log import Frame, LogLike, RobotLog
from stribeck.core.log.overlap import Prints, prints
from stribeck.core.log.sampling import Sampling, regularise
from stribeck.core.robot import Robot
from stribeck.core.settings import LogTable, Settings

Progress = Callable[[str, float], None]
"""Callback `progress(stage, fraction)` with fraction from 0 to 1."""


def quiet(*_: object) -> None:
    """Show no progress."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PreparedLog:
    """Evenly sampled log with support phases; long logs are kept on disk (`stribeck.core.log.storage`).

    Attributes
    ----------
    log
        Log, evenly sampled within each segment of `sampling`.
    prints
        Fingerprints that detect the same samples in another log (`stribeck.core.log.overlap`).
    notes
        Changes to the log, one sentence each; problems are reported by the audit (`stribeck.check.audit`).
    """

    log: RobotLog
    sampling: Sampling
    support: SupportPhases
    prints: Prints
    notes: tuple[str, ...] = ()


Logs = Sequence[PreparedLog]
"""Prepared logs of one robot."""


def prepare(log: LogLike, robot: Robot, settings: Settings) -> PreparedLog:
    """Read a log, resample it evenly and find its support phases.

    Raises
    ------
    RobotFileError
        If no joint's torque is measured.
    LogError, SettingsError
        If the log cannot be used, or the filter of the settings does not suit it.
    """
    with errors_about(log_path(log)), findings_kept() as notes:
        log = as_read(log, robot)
        if spans := [*spans_of_log(robot.log_table.exclude, log.path), *changes_of_payload(robot, log.path)]:
            log = log.excluding(spans)
        notes += log.notes
        log, of_loops = closed_log(log, robot)
        notes += of_loops
        of_log = prints(log)
        log = replace(log, desired_position=None, desired_velocity=None, desired_torque=None)  # `command` has them
        log, sampling = regularise(log, robot.log_table)
        log = with_payloads(log, robot, sampling)
        log, of_gyroscope = with_gyroscope(log, sampling.segments, sampling.period)
        notes += [*sampling.notes, *of_gyroscope]
        if not len(robot.torque_controlled):
            raise RobotFileError(
                f"{robot.path}: [robot] position_controlled names all joints; expected one with measured torque"
            )
        support = find_support_phases(log, robot, sampling.segments, settings.support)
        notes += support.notes
    if settings.filter.kind != "auto":
        make_filter(settings.filter, sampling.period)  # refuse wrong settings before a method runs for minutes
    if robot.base == "floating" and log.base_orientation is None:
        notes.append("no base orientation: the standing foot is assumed to be level")
    return PreparedLog(log=log, sampling=sampling, support=support, prints=of_log, notes=tuple(notes))


def log_path(log: LogLike) -> str:
    """Find the path of a log; "" for a log in memory."""
    return log.path if isinstance(log, RobotLog) else str(log) if isinstance(log, str | Path) else ""


def as_read(log: LogLike, robot: Robot) -> RobotLog:
    """Read a path or a frame; refuse a log that was read without the robot if the robot would change it.

    Raises
    ------
    LogError
        If the log was read without the robot, or has another type.
    """
    if isinstance(log, str | Path):
        return cast(RobotLog, SERVICES["read_log"](log, robot))
    if isinstance(log, Frame):
        return RobotLog.from_frame(log, robot)
    if not isinstance(log, RobotLog):
        raise LogError(
            f"log: is of type '{type(log).__name__}'; expected a RobotLog, a path, a frame, or a list of them"
        )
    applied_later = LogTable(max_gap=robot.log_table.max_gap, exclude=robot.log_table.exclude)
    changes = robot.log_table != applied_later or robot.motors or robot.has_kp
    if log.raw and (changes or log.joint_names != robot.joint_names or log.torque_source != robot.torque_source):
        raise LogError(
            f"{log.path or 'log'}: was read without the robot, so its settings for logs were not applied; "
            "pass the robot to read_log or RobotLog.from_frame"
        )
    return log


def log_names(prepared: Logs) -> list[str]:
    """Name each log for messages: by its path, or its number."""
    return [part.log.path or ("log" if len(prepared) == 1 else f"log {k}") for k, part in enumerate(prepared, 1)]
