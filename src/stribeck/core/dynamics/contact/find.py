"""Support phases of a log, from its best source.

To add a source:

1. Write `contact/<source>.py` with a function that computes which feet stand, bool of shape (T, feet), and notes, one
   sentence each. Rows outside the segments are ignored.
2. Add its name to `Source` in `contact/phases.py` and to `SupportSettings.source`.
3. Call it in `_find_standing` below, and choose it in `_choose_source` for the logs that it suits best. Cutting and
   trimming are the same for all sources.
4. Describe in `_describe_no_standing` what a user should do if no foot ever stands.
5. Add it to `tests/contact/test_contact.py` and to docs/logs.md.
"""

import numpy as np

from stribeck.core.dynamics.contact.flicker import without_flicker
from stribeck.core.dynamics.contact.forces import foot_loads, force_channel, standing_from_forces
from stribeck.core.dynamics.contact.kinematics import share_at_rest, standing_from_kinematics
from stribeck.core.dynamics.contact.phases import (
    FALLEN,
    Segments,
    Source,
    Standing,
    SupportPhase,
    SupportPhases,
    fixed_phases,
    phases_of_segment,
    row_of_fall,
)
from stribeck.core.errors import LogError, RobotFileError
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.core.settings import SupportSettings

HANGS = 0.7
"""Share at rest [1] of the stillest foot below which no foot stands: at most 0.3 in a gantry, at least 0.8 on walks."""


def find_support_phases(
    log: RobotLog, robot: Robot, sampling_segments: Segments, settings: SupportSettings
) -> SupportPhases:
    """Find the standing feet over time: from contact flags, else from foot forces, else from kinematics.

    Parameters
    ----------
    log
        Whole log.
    robot
        Robot, with base, contacts, weight and kinematics.
    sampling_segments
        Rows without gaps; phases do not cross from one segment to the next.
    settings
        Source, thresholds, and the times trimmed from each phase.

    Returns
    -------
    SupportPhases
        Phases that cover all segments without gap or overlap, up to a fall of the robot. If no foot ever stands, the
        robot is hung up, provided that the base orientation is measured.

    Raises
    ------
    LogError
        If the log's feet differ from the robot's, a required channel is missing, forces have a wrong sign or unit, the
        robot lies from the start, or no foot ever stands.
    RobotFileError
        If a robot with a floating base has no contacts.
    SettingsError
        If the lower force threshold is above the upper one.
    """
    segments = tuple(segment for segment in sampling_segments if segment.stop > segment.start)
    if robot.base == "fixed":
        return SupportPhases(phases=fixed_phases(segments), source="fixed")
    if not robot.contacts:
        raise RobotFileError(
            f"{robot.path or 'robot file'}: a floating base needs contacts; "
            "add [contacts.<foot>] with a frame, or set [robot] base = 'fixed'"
        )
    if not segments:
        raise LogError(f"{log.path or 'log'}: no segment of evenly sampled rows is left; expected at least one")
    source = _choose_source(log, settings)
    if {"flags": log.contact, "forces": force_channel(log)}.get(source) is not None:
        _check_feet(log, tuple(robot.contacts))
    fall = row_of_fall(log, robot, segments)
    if fall is not None:
        segments = tuple(slice(s.start, min(s.stop, fall)) for s in segments if s.start < fall)
    standing, touching, notes = _find_standing(log, robot, segments, settings, source)
    if fall is None and (source == "kinematics" or not any(standing[segment].any() for segment in segments)):
        rest = share_at_rest(log, robot, segments)
        still = rest is None and log.base_orientation is not None and source != "kinematics"
        if still or (rest is not None and rest < HANGS):
            note = "No foot ever stands: the robot is taken as hung up at its base, which may move."
            return SupportPhases(phases=fixed_phases(segments, "hung"), source=source, notes=(note,))
    standing, touching = without_flicker(standing, touching, log.time, segments)
    phases = [
        phase
        for segment in segments
        for phase in phases_of_segment(standing, touching, tuple(robot.contacts), log.time, segment, settings)
    ]
    if fall is not None:
        phases = [phase for phase in phases if phase.stop < fall]
        notes.append(
            f"The robot falls: its base tilts by more than {np.rad2deg(FALLEN):.0f}° at "
            f"{log.time[fall]:.2f} s; the phase of the fall and all later ones are ignored."
        )
    if not any(phase.feet for phase in phases):
        raise LogError(_describe_no_standing(log, robot, source, settings, fall))
    return SupportPhases(phases=tuple(phases), source=source, notes=(*notes, *_note_short_phases(phases, settings)))


def _choose_source(log: RobotLog, settings: SupportSettings) -> Source:
    if settings.source != "auto":
        return settings.source
    if log.contact is not None:
        return "flags"
    return "forces" if force_channel(log) else "kinematics"


def _check_feet(log: RobotLog, feet: tuple[str, ...]) -> None:
    """Refuse a log whose feet differ from the robot's."""
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


def _find_standing(
    log: RobotLog, robot: Robot, segments: Segments, settings: SupportSettings, source: Source
) -> Standing:
    """Find the feet that stand or touch the ground, according to a source."""
    if source == "forces":
        return standing_from_forces(log, robot, segments, settings)
    none = np.zeros((len(log.time), len(robot.contacts)), dtype=bool)
    if source == "kinematics" and "wheel" in {contact.kind for contact in robot.contacts.values()}:
        return ~none, none, ["The log has neither contact flags nor foot forces: wheels are taken as on the ground."]
    if source == "kinematics":
        return standing_from_kinematics(log, robot, segments)
    if log.contact is None:
        raise LogError(f"{log.path or 'log'}: [identify.support] source is 'flags', but the log has no channel contact")
    return log.contact[:, [log.foot_names.index(foot) for foot in robot.contacts]], none, []


def _describe_no_standing(
    log: RobotLog, robot: Robot, source: Source, settings: SupportSettings, fall: int | None
) -> str:
    """Describe the case that no foot ever stands."""
    start = f"{log.path or 'log'}: no foot ever stands"
    if fall is not None:
        return f"{start} before the robot falls at {log.time[fall]:.2f} s; expected at least one whole support phase"
    if source == "forces":
        weight = robot.mass * float(np.linalg.norm(robot.gravity))
        most = float(foot_loads(log, robot).max())
        return (
            f"{start}: the largest load of a foot in {force_channel(log)} is {most:.4g} N, but the threshold is "
            f"{settings.force_on * weight:.4g} N ([identify.support] force_on times the weight of {weight:.4g} N)"
        )
    flags = f"all contact flags of {', '.join(robot.contacts)} are false"
    if log.base_orientation is not None:
        return f"{start}: {flags}, but some foot always rests; set [identify.support] source = 'kinematics'"
    return f"{start}: {flags}; if the robot hangs, log its base orientation or set [robot] base = 'fixed'"


def _note_short_phases(phases: list[SupportPhase], settings: SupportSettings) -> list[str]:
    """Note the phases with standing feet that are empty after trimming."""
    lost = sum(1 for phase in phases if phase.feet and phase.first == phase.last)
    if lost == 0:
        return []
    return [
        f"{lost} of {len(phases)} support phases are ignored: shorter than {settings.min_duration:g} s, or a foot "
        "carries only a part of its load."
    ]
