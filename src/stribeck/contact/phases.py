"""Support phases: the parts of a log over which the same feet stand, each in one contact mode."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.dynamics.root_motion import gravity_in_root_link
from stribeck.dynamics.state import root_quaternions
from stribeck.errors import LogError
from stribeck.log import RobotLog
from stribeck.log.storage import BLOCK_ROWS
from stribeck.robot import Robot
from stribeck.settings import SupportSettings

FALLEN = np.deg2rad(60.0)
"""Tilt of a base that has fallen [rad]."""

Kind = Literal["fixed", "single", "double", "multiple", "flight", "touching"]
Source = Literal["fixed", "flags", "forces", "kinematics"]


@dataclass(frozen=True, kw_only=True)
class SupportPhase:
    """The time of one contact mode, in which the same feet stand; the rows are those of the log.

    Attributes
    ----------
    start, stop
        The whole phase is rows [start, stop).
    feet
        Names of the standing contacts, in the robot's order; ("base",) for a fixed base.
    kind
        "single", "double" and "multiple" count the standing feet; "flight" has none. In "touching" some foot carries a
        part of its load, so that it neither stands nor swings: nothing of it is worked through.
    first, last
        Rows [first, last) are worked through; none where `last == first`.
    steady_first, steady_last
        In rows [steady_first, steady_last), clear of touch-downs and lift-offs, the standing feet are at rest: a fit
        may use any joint. Of swinging legs, which hardly feel it, it may use all rows.
    """

    start: int
    stop: int
    feet: tuple[str, ...]
    kind: Kind
    first: int
    last: int
    steady_first: int
    steady_last: int


@dataclass(frozen=True, kw_only=True)
class SupportPhases:
    """All phases in the order of time, where they were found, and what the user should know, a sentence each."""

    phases: tuple[SupportPhase, ...]
    source: Source
    notes: tuple[str, ...] = ()


def fixed_phases(segments: tuple[slice, ...]) -> tuple[SupportPhase, ...]:
    """Return the phases of a fixed base: one a segment, nothing trimmed."""
    return tuple(
        SupportPhase(start=a, stop=b, feet=("base",), kind="fixed", first=a, last=b, steady_first=a, steady_last=b)
        for a, b in ((segment.start, segment.stop) for segment in segments)
        if b > a
    )


def phases_of_segment(
    standing: NDArray[np.bool_],
    touching: NDArray[np.bool_],
    feet: tuple[str, ...],
    time: Array,
    segment: slice,
    settings: SupportSettings,
) -> list[SupportPhase]:
    """Cut a segment into phases; together they are the whole segment.

    A phase loses `trim_start` after its beginning and `trim_end` before its end, because the lift-off and the
    touch-down there are impacts; one in which all feet stand is worked through as a whole. Standing feet rock and slip
    a little afterwards, and while the weight shifts from foot to foot: a phase is steady where it is clear of both
    times together at both ends. Where it begins or ends with the segment there is no such event, and nothing is
    trimmed. A phase shorter than `min_duration` keeps its place, but nothing of it remains.

    Parameters
    ----------
    standing, touching
        Which feet stand, and which carry some load all the same, shape (T, feet), rows of the whole log.
    feet
        Their names.
    time
        [s], shape (T,).
    """
    undecided = touching[segment].any(axis=1, keepdims=True)
    rows = np.hstack([standing[segment] & ~undecided, undecided])
    changes = np.flatnonzero(np.any(rows[1:] != rows[:-1], axis=1)) + 1 + segment.start
    edges = [segment.start, *(int(row) for row in changes), segment.stop]
    period = float(np.median(np.diff(time[segment]))) if len(rows) > 1 else 0.0

    def trimmed(start: int, stop: int, after: float, before: float) -> tuple[int, int]:
        """Leave out so many seconds at the ends; half a period decides what is equal."""
        first = int(np.searchsorted(time, time[start] + after - period / 2)) if start > segment.start else start
        last = int(np.searchsorted(time, time[stop - 1] - before + period / 2)) if stop < segment.stop else stop
        return first, last

    both = settings.trim_start + settings.trim_end
    phases = []
    for start, stop in pairwise(edges):
        row = rows[start - segment.start]
        standing_feet = tuple(foot for foot, stands in zip(feet, row[:-1], strict=True) if stands)
        first, last = start, stop
        if len(standing_feet) < len(feet):
            first, last = trimmed(start, stop, settings.trim_start, settings.trim_end)
        steady_first, steady_last = trimmed(start, stop, both, both)
        if last <= first or (stop - start) * period < settings.min_duration or row[-1]:
            first = last = start
        if steady_last <= steady_first or last == first:
            steady_first = steady_last = first
        kinds: tuple[Kind, ...] = ("flight", "single", "double", "multiple")
        phases.append(
            SupportPhase(
                start=start,
                stop=stop,
                feet=standing_feet,
                kind="touching" if row[-1] else kinds[min(len(standing_feet), 3)],
                first=first,
                last=last,
                steady_first=steady_first,
                steady_last=steady_last,
            )
        )
    return phases


def switch(signal: Array, on: float, off: float) -> NDArray[np.bool_]:
    """Apply a threshold with hysteresis: on above `on`, off below `off`, in between as before.

    Parameters
    ----------
    signal
        Shape (T, k); each column is a switch of its own. A first value in between counts for the nearer threshold.
    on, off
        `off` is not above `on`.
    """
    decided = (signal > on) | (signal < off)
    decided[:1] = True
    latest = np.maximum.accumulate(np.where(decided, np.arange(len(signal))[:, None], 0), axis=0)
    return np.asarray(np.take_along_axis(signal, latest, axis=0) > (on + off) / 2)


def up_in_base(log: RobotLog, robot: Robot) -> Array:
    """Compute the upward direction in the root link's coordinates, shape (T, 3); a base without IMU counts as level."""
    up = -robot.gravity / np.linalg.norm(robot.gravity)
    if log.base_orientation is None:
        return np.broadcast_to(up, (len(log.time), 3))
    return gravity_in_root_link(root_quaternions(robot, log.position, log.base_orientation), up)


def row_of_fall(log: RobotLog, robot: Robot, segments: tuple[slice, ...]) -> int | None:
    """Find the first row within the segments at which the base has fallen over, None if it never does.

    Upright is the root link's z axis. A root link whose z axis does not point up when the robot stands would look
    fallen from the start, and is refused.

    Raises
    ------
    LogError
        If the base is tilted that far from the start.
    """
    if log.base_orientation is None:
        return None
    starts = [(start, rows.stop) for rows in segments for start in range(rows.start, rows.stop, BLOCK_ROWS)]
    for place, (start, stop) in enumerate(starts):
        block = slice(start, min(start + BLOCK_ROWS, stop))
        tilt = np.arccos(np.clip(up_in_base(log.take(block), robot)[:, 2], -1.0, 1.0))
        fallen = np.flatnonzero(tilt > FALLEN)
        if len(fallen) == 0:
            continue
        if place or fallen[0]:
            return int(start + fallen[0])
        if robot.gravity[2] > 0:
            raise LogError(
                f"{log.path or 'log'}: [robot] gravity points up, {robot.gravity.tolist()} m/s^2, and the robot "
                "stands on its head; expected gravity of the world, z down, as a rule [0, 0, -9.81]"
            )
        raise LogError(
            f"{log.path or 'log'}: base_orientation tilts the base by {np.rad2deg(tilt[0]):.0f} deg at the start, "
            'so that the robot lies; if it stands, set [log] base_orientation = {order = "wxyz"} or [robot] base_frame'
        )
    return None
