"""Support phases: parts of a log with the same standing feet, each in one contact mode."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.dynamics.root_motion import gravity_in_root_link
from stribeck.core.dynamics.state import root_quaternions
from stribeck.core.errors import LogError
from stribeck.core.log import RobotLog
from stribeck.core.log.storage import BLOCK_ROWS
from stribeck.core.robot import Robot
from stribeck.core.settings import SupportSettings

FALLEN = np.deg2rad(60.0)
"""Base tilt above which the robot has fallen [rad]."""

HUNG = "hung"
"""Name in place of the feet while something unknown, such as a gantry, carries the base."""

Kind = Literal["fixed", "hung", "single", "double", "multiple", "flight", "touching"]
Source = Literal["fixed", "flags", "forces", "kinematics"]
Segments = tuple[slice, ...]
"""Rows between gaps of a log, in order."""
Standing = tuple[BoolArray, BoolArray, list[str]]
"""Feet that stand, and feet that carry some load without standing, shape (T, feet) each, and notes."""


@dataclass(frozen=True, kw_only=True)
class SupportPhase:
    """Time during which the same feet stand; rows refer to the log.

    Attributes
    ----------
    start, stop
        The whole phase is rows [start, stop).
    feet
        Names of the standing contacts, in the robot's order; ("base",) for a fixed base, ("hung",) in a gantry.
    kind
        "single", "double" and "multiple" count the standing feet; "flight" has none. In "touching", some foot carries a
        part of its load, so that it neither stands nor swings: none of its rows are used.
    first, last
        Rows [first, last) are used; none if `last == first`.
    steady_first, steady_last
        The standing feet are at rest in rows [steady_first, steady_last), away from touchdown and liftoff: fits may use
        all joints. Fits may use swinging legs, which are hardly affected, in all rows.
    """

    start: int
    stop: int
    feet: tuple[str, ...]
    kind: Kind
    first: int
    last: int
    steady_first: int
    steady_last: int

    @property
    def steps(self) -> bool:
        """Whether feet land or lift at its ends."""
        return self.kind not in ("fixed", "hung")

    def plausible(self, period: float) -> bool:
        """Check the duration of a flight: more than 1 s indicates wrong contact flags."""
        return self.kind != "flight" or (self.stop - self.start) * period <= 1.0


@dataclass(frozen=True, kw_only=True)
class SupportPhases:
    """All phases in the order of time, their source, and notes for the user, one sentence each."""

    phases: tuple[SupportPhase, ...]
    source: Source
    notes: tuple[str, ...] = ()


def fixed_phases(segments: Segments, kind: Literal["fixed", "hung"] = "fixed") -> tuple[SupportPhase, ...]:
    """Make the phases of a fixed or hung base: one per segment, not trimmed."""
    feet = ("base",) if kind == "fixed" else (HUNG,)
    return tuple(
        SupportPhase(start=a, stop=b, feet=feet, kind=kind, first=a, last=b, steady_first=a, steady_last=b)
        for a, b in ((segment.start, segment.stop) for segment in segments)
        if b > a
    )


def phases_of_segment(
    standing: BoolArray,
    touching: BoolArray,
    feet: tuple[str, ...],
    time: Array,
    segment: slice,
    settings: SupportSettings,
) -> list[SupportPhase]:
    """Cut a segment into phases that cover it completely.

    A phase loses `trim_start` at its start and `trim_end` at its end, because liftoff and touchdown are impacts, but at
    most a share of its duration (`trims`). Phases in which all feet stand are used completely. Standing feet rock and
    slip a little after an impact and while the weight shifts: the steady part loses both times at both ends. Nothing is
    trimmed where a phase starts or ends with the segment, because there is no impact. A phase shorter than
    `min_duration` remains, but none of its rows are used.

    Parameters
    ----------
    standing, touching
        Feet that stand, and feet that carry some load without standing, shape (T, feet), rows of the whole log.
    feet
        Names of the feet.
    time
        Time [s], shape (T,).
    """
    undecided = touching[segment].any(axis=1, keepdims=True)
    rows = np.hstack([standing[segment] & ~undecided, undecided])
    changes = np.flatnonzero(np.any(rows[1:] != rows[:-1], axis=1)) + 1 + segment.start
    edges = [segment.start, *(int(row) for row in changes), segment.stop]
    period = float(np.median(np.diff(time[segment]))) if len(rows) > 1 else 0.0

    def trim(start: int, stop: int, after: float, before: float) -> tuple[int, int]:
        """Trim times [s] at both ends; times within half a period count as equal."""
        first = int(np.searchsorted(time, time[start] + after - period / 2)) if start > segment.start else start
        last = int(np.searchsorted(time, time[stop - 1] - before + period / 2)) if stop < segment.stop else stop
        return first, last

    both = settings.trim_start + settings.trim_end
    phases = []
    for start, stop in pairwise(edges):
        cut = start == segment.start or stop == segment.stop  # the log does not show how long the phase is
        duration = np.inf if cut else (stop - start) * period
        after, before = trims(duration, settings.trim_start, settings.trim_end)
        row = rows[start - segment.start]
        standing_feet = tuple(foot for foot, stands in zip(feet, row[:-1], strict=True) if stands)
        first, last = trim(start, stop, after, before) if len(standing_feet) < len(feet) else (start, stop)
        steady_first, steady_last = trim(start, stop, both, both)
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


def trims(duration: float, start: float, end: float, shortest: float = 0.0) -> tuple[float, float]:
    """Limit the times that are trimmed at both ends of a phase to a share of its duration, all in [s].

    Phases keep the time `shortest`, if that is possible.
    """
    # Largest shares of a phase that are trimmed where it would be too short otherwise, and elsewhere [1]. Feet settle
    # faster in fast gaits.
    trimmed = 0.25, 0.45
    few, many = np.multiply(trimmed, duration)
    share = min(1.0, float(np.clip(duration - shortest, few, many)) / max(start + end, 1e-9))
    return share * start, share * end


def switch(signal: Array, on: float, off: float) -> BoolArray:
    """Apply a threshold with hysteresis: on above `on`, off below `off`, unchanged in between.

    Parameters
    ----------
    signal
        Signals, shape (T, k), one switch per column. A first value in between takes the state of the nearer threshold.
    on, off
        Thresholds; `off` is not above `on`.
    """
    decided = (signal > on) | (signal < off)
    decided[:1] = True
    latest = np.maximum.accumulate(np.where(decided, np.arange(len(signal))[:, None], 0), axis=0)
    return np.asarray(np.take_along_axis(signal, latest, axis=0) > (on + off) / 2)


def up_in_base(log: RobotLog, robot: Robot) -> Array:
    """Compute the upward direction in root link coordinates, shape (T, 3); a base without IMU counts as level."""
    if log.base_orientation is None:
        return np.broadcast_to(robot.up, (len(log.time), 3))
    return gravity_in_root_link(root_quaternions(robot, log.position, log.base_orientation), robot.up)


def row_of_fall(log: RobotLog, robot: Robot, segments: Segments) -> int | None:
    """Find the first row within the segments at which the base has fallen over; None if it never falls.

    The z axis of the root link counts as up. A root link whose z axis does not point up when the robot stands looks
    fallen from the start, and is refused.

    Raises
    ------
    LogError
        If the base is tilted too much from the start.
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
        x, y, z, w = log.base_orientation[start]
        vertical = 0.0 - 9.81 * np.round([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x**2 + y**2)])
        raise LogError(
            f"{log.path or 'log'}: base_orientation tilts the base by {np.rad2deg(tilt[0]):.0f}° at the start, "
            'as if the robot had fallen; if not, set order = "wxyz" or mount in [log.base_orientation], base_frame in '
            f"[robot], or, if that is down in the log's world, gravity = {vertical.tolist()} in [robot]"
        )
    return None
