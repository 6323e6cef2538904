"""Preparation of a log: reading, even sampling, and support phases."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from stribeck.contact import SupportPhases, find_support_phases
from stribeck.differentiation import make_filter
from stribeck.dynamics.loops import closed_log
from stribeck.errors import RobotFileError, errors_about, findings_kept
from stribeck.log import RobotLog
from stribeck.log.overlap import Prints, prints
from stribeck.log.readers import read_log
from stribeck.log.sampling import Sampling, regularise
from stribeck.robot import Robot
from stribeck.settings import Settings

Progress = Callable[[str, float], None]
"""Callback `progress(stage, fraction)` with fraction from 0 to 1."""


def quiet(*_: object) -> None:
    """Show no progress."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PreparedLog:
    """Evenly sampled log with support phases; long logs are kept on disk (`stribeck.log.storage`).

    Attributes
    ----------
    log
        Log, evenly sampled within each segment of `sampling`.
    prints
        Fingerprints that detect the same samples in another log (`stribeck.log.overlap`).
    notes
        Changes to the log, one sentence each; problems are reported by the audit (`stribeck.audit`).
    """

    log: RobotLog
    sampling: Sampling
    support: SupportPhases
    prints: Prints
    notes: tuple[str, ...] = ()


def prepare(log: RobotLog | str | Path, robot: Robot, settings: Settings) -> PreparedLog:
    """Read a log, resample it evenly and find its support phases.

    Raises
    ------
    RobotFileError
        If no joint's torque is measured.
    LogError, SettingsError
        If the log cannot be used, or the filter of the settings does not suit it.
    """
    with errors_about(log.path if isinstance(log, RobotLog) else str(log)), findings_kept() as notes:
        if not isinstance(log, RobotLog):
            log = read_log(log, robot)
        notes += log.notes
        log, of_loops = closed_log(log, robot)
        notes += of_loops
        of_log = prints(log)
        log, sampling = regularise(log, robot.log_table)
        notes += sampling.notes
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


def log_names(prepared: Sequence[PreparedLog]) -> list[str]:
    """Name each log for messages: by its path, or its number."""
    return [part.log.path or ("log" if len(prepared) == 1 else f"log {k}") for k, part in enumerate(prepared, 1)]
