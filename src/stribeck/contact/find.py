"""Support phases of a log, from the best source that it has.

To add a source:

1. Write `contact/<source>.py` with a function that returns which feet stand, bool of shape (T, feet), and notes, a
   sentence each. Rows outside the segments are not looked at.
2. Add its name to `Source` in `contact/phases.py` and to `SupportSettings.source`.
3. Call it in `_standing` below, and say in `_source` which logs it is the best source for. Cutting and trimming are
   common to all sources.
4. Say in `_nothing_stands` what a user should do if by it no foot ever stands.
5. Add it to `tests/contact/test_contact.py` and to docs/logs.md.
"""

import numpy as np
from numpy.typing import NDArray

from stribeck.contact.forces import foot_loads, force_channel, standing_from_forces
from stribeck.contact.kinematics import standing_from_kinematics
from stribeck.contact.phases import (
    FALLEN,
    Source,
    SupportPhase,
    SupportPhases,
    fixed_phases,
    phases_of_segment,
    row_of_fall,
)
from stribeck.errors import LogError, RobotFileError
from stribeck.log import RobotLog
from stribeck.robot import Robot
from stribeck.settings import SupportSettings


def find_support_phases(
    log: RobotLog, robot: Robot, sampling_segments: tuple[slice, ...], settings: SupportSettings
) -> SupportPhases:
    """Find which feet stand when: from contact flags, else from foot forces, else from kinematics.

    Parameters
    ----------
    log
        The whole log.
    robot
        Its base, contacts, weight and kinematics.
    sampling_segments
        Rows without gaps; no phase crosses from one into the next.
    settings
        Which source, its thresholds, and what is trimmed off each phase.

    Returns
    -------
    SupportPhases
        They cover every segment without gap or overlap, up to a fall of the robot.

    Raises
    ------
    LogError
        If the log's feet are not the robot's, a channel asked for or needed is missing, forces have a wrong sign or
        unit, the robot lies from the start, or no foot ever stands.
    RobotFileError
        If a robot with a floating base has no contacts.
    SettingsError
        If the force thresholds are the wrong way round.
    """
    segments = tuple(segment for segment in sampling_segments if segment.stop > segment.start)
    if robot.base == "fixed":
        return SupportPhases(phases=fixed_phases(segments), source="fixed")
    feet = tuple(robot.contacts)
    if not feet:
        raise RobotFileError(
            f"{robot.path or 'robot file'}: a floating base stands on contacts, but there are none; "
            "add [contacts.<foot>] with a frame, or set [robot] base = 'fixed'"
        )
    if not segments:
        raise LogError(f"{log.path or 'log'}: no segment of evenly sampled rows is left; expected at least one")
    source = _source(log, settings)
    if {"flags": log.contact, "forces": force_channel(log)}.get(source) is not None:
        _check_feet(log, feet)
    fall = row_of_fall(log, robot, segments)
    if fall is not None:
        segments = tuple(slice(s.start, min(s.stop, fall)) for s in segments if s.start < fall)
    standing, touching, notes = _standing(log, robot, feet, segments, settings, source)
    found = [
        phase
        for segment in segments
        for phase in phases_of_segment(standing, touching, feet, log.time, segment, settings)
    ]
    if fall is not None:
        found = [phase for phase in found if phase.stop < fall]
        notes.append(
            f"The robot falls: its base is tilted by more than {np.rad2deg(FALLEN):.0f} deg from "
            f"{log.time[fall]:.2f} s; the phase in which that happens and all later ones are left out."
        )
    if not any(phase.feet for phase in found):
        raise LogError(_nothing_stands(log, robot, feet, source, settings, fall))
    return SupportPhases(phases=tuple(found), source=source, notes=(*notes, *_short_phases(found, settings)))


def _source(log: RobotLog, settings: SupportSettings) -> Source:
    if settings.source != "auto":
        return settings.source
    if log.contact is not None:
        return "flags"
    return "forces" if force_channel(log) else "kinematics"


def _check_feet(log: RobotLog, feet: tuple[str, ...]) -> None:
    """Refuse a log whose feet are not the robot's."""
    unknown = [foot for foot in log.foot_names if foot not in feet]
    missing = [foot for foot in feet if foot not in log.foot_names]
    name = log.path or "log"
    if unknown:
        raise LogError(
            f"{name}: foot '{unknown[0]}' is not one of the robot's contacts, which are {', '.join(feet)}; "
            f'map it in [log] foot_names, e.g. {{{unknown[0]} = "{(missing or feet)[0]}"}}'
        )
    if missing:
        raise LogError(
            f"{name}: the robot's contact '{missing[0]}' is not among the log's feet, which are "
            f"{', '.join(log.foot_names) or 'none'}; remove [contacts.{missing[0]}] or map a name in [log] foot_names"
        )


def _standing(
    log: RobotLog,
    robot: Robot,
    feet: tuple[str, ...],
    segments: tuple[slice, ...],
    settings: SupportSettings,
    source: Source,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], list[str]]:
    """Return which feet stand, which carry some load although they do not, shape (T, feet) each, and notes."""
    if source == "forces":
        return standing_from_forces(log, robot, feet, segments, settings)
    none = np.zeros((len(log.time), len(feet)), dtype=bool)
    if source == "kinematics":
        standing, notes = standing_from_kinematics(log, robot, feet, segments)
        return standing, none, notes
    if log.contact is None:
        raise LogError(f"{log.path or 'log'}: [identify.support] source is 'flags', but the log has no channel contact")
    return log.contact[:, [log.foot_names.index(foot) for foot in feet]], none, []


def _nothing_stands(
    log: RobotLog, robot: Robot, feet: tuple[str, ...], source: Source, settings: SupportSettings, fall: int | None
) -> str:
    """Say that no foot ever stands, and what was found instead."""
    start = f"{log.path or 'log'}: no foot ever stands"
    if fall is not None:
        return f"{start} before the robot falls at {log.time[fall]:.2f} s; expected at least one whole support phase"
    if source == "forces":
        weight = robot.mass * float(np.linalg.norm(robot.gravity))
        most = float(foot_loads(log, robot, feet).max())
        return (
            f"{start}: the largest load of a foot in {force_channel(log)} is {most:.4g} N, but standing begins at "
            f"{settings.force_on * weight:.4g} N ([identify.support] force_on times the weight of {weight:.4g} N)"
        )
    return f"{start}: all contact flags of {', '.join(feet)} are false; if the base is held, set [robot] base = 'fixed'"


def _short_phases(phases: list[SupportPhase], settings: SupportSettings) -> list[str]:
    """Remark on phases of which nothing remains although some foot stands."""
    lost = sum(1 for phase in phases if phase.feet and phase.first == phase.last)
    if lost == 0:
        return []
    return [
        f"{lost} of {len(phases)} support phases are too short to keep anything of after trimming "
        f"({settings.trim_start:g} s at the start, {settings.trim_end:g} s at the end) "
        f"or shorter than {settings.min_duration:g} s."
    ]
