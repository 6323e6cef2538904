"""A log made ready, once: read, on an even clock, its support phases found, and what a user should know of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stribeck.contact import SupportPhases, find_support_phases
from stribeck.errors import errors_about, findings_kept
from stribeck.log import RobotLog
from stribeck.log.readers import read_log
from stribeck.log.sampling import Sampling, regularise
from stribeck.motion import make_filter
from stribeck.robot import Robot
from stribeck.settings import Settings

Progress = Callable[[str, float], None]
"""Told the stage and how much of it is done, from 0 to 1."""

STOP_MARGIN = 1e-3
"""[rad] or [m]"""

MUCH_LOST = 0.2
"""Share of the samples [1] that are cut out or between gaps, from which that is a warning."""


def quiet(*_: object) -> None:
    """Show no progress."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PreparedLog:
    """A log that is evenly sampled, with its support; long logs lie on disk (`stribeck.log.storage`).

    Attributes
    ----------
    log
        Evenly sampled within each segment of `sampling`.
    notes, warnings
        What was done to it, and what a user should act on, a sentence each.
    """

    log: RobotLog
    sampling: Sampling
    support: SupportPhases
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


def prepare(log: RobotLog | str | Path, robot: Robot, settings: Settings) -> PreparedLog:
    """Read a log, put it on an even clock and find its support phases.

    Raises
    ------
    LogError, SettingsError
        If the log cannot be used, or the filter of the settings does not suit it.
    """
    with errors_about(log.path if isinstance(log, RobotLog) else str(log)), findings_kept() as notes:
        if not isinstance(log, RobotLog):
            log = read_log(log, robot)
        notes += log.notes
        log, sampling = regularise(log, robot.log_table)
        notes += sampling.notes
        support = find_support_phases(log, robot, sampling.segments, settings.support)
        notes += support.notes
    if settings.filter.kind != "auto":
        make_filter(settings.filter, sampling.period)  # refused now, and not once a method has worked for minutes
    if robot.base == "floating" and log.base_orientation is None:
        notes.append("no base orientation: the standing foot is taken to be level")
    warnings = [*_much_lost(sampling, log.path), *_stops_reached(log, robot)]
    return PreparedLog(log=log, sampling=sampling, support=support, notes=tuple(notes), warnings=tuple(warnings))


def _much_lost(sampling: Sampling, path: str) -> list[str]:
    """Return a warning where much of a log cannot be used."""
    if sampling.lost <= MUCH_LOST:
        return []
    return [
        f"{path or 'log'}: {100 * sampling.lost:.0f} % of the samples are not used, as they lack values or lie between "
        f"gaps that are close to each other ({len(sampling.gaps)} gaps); [log] max_gap would bridge longer ones"
    ]


def _stops_reached(log: RobotLog, robot: Robot) -> list[str]:
    """Return a warning about joints that reach the end of their range, where a stop's torque is taken for friction."""
    low, high = robot.position_limits
    lowest, highest = log.position.min(axis=0), log.position.max(axis=0)
    reached = np.flatnonzero((lowest < low + STOP_MARGIN) | (highest > high - STOP_MARGIN))
    if len(reached) == 0:
        return []
    spans = [
        f"{robot.joint_names[k]} ({lowest[k]:.3g} to {highest[k]:.3g}, limits {low[k]:.3g} to {high[k]:.3g})"
        for k in reached
    ]
    return [
        "joints reach the end of their range in the model, where a stop would take part of the torque: "
        + ", ".join(spans)
    ]
