"""Support phases: the parts of a log over which the same feet stand, each in one contact mode."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stribeck.settings import SupportSettings
from stribeck.typing import Array

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
        SupportPhase(
            start=s.start,
            stop=s.stop,
            feet=("base",),
            kind="fixed",
            first=s.start,
            last=s.stop,
            steady_first=s.start,
            steady_last=s.stop,
        )
        for s in segments
        if s.stop > s.start
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
    phases = []
    for start, stop in pairwise(edges):
        row = rows[start - segment.start]
        standing_feet = tuple(foot for foot, stands in zip(feet, row[:-1], strict=True) if stands)
        swinging = len(standing_feet) < len(feet)
        both = settings.trim_start + settings.trim_end
        first, last = start, stop
        steady_first = _row_after(time, start, both, period) if start > segment.start else start
        steady_last = _row_before(time, stop, both, period) if stop < segment.stop else stop
        if swinging:
            first = _row_after(time, start, settings.trim_start, period) if start > segment.start else start
            last = _row_before(time, stop, settings.trim_end, period) if stop < segment.stop else stop
        if last <= first or (stop - start) * period < settings.min_duration or row[-1]:
            first = last = start
        if steady_last <= steady_first or last == first:
            steady_first = steady_last = first
        phases.append(
            SupportPhase(
                start=start,
                stop=stop,
                feet=standing_feet,
                kind="touching" if row[-1] else _kind(standing_feet),
                first=first,
                last=last,
                steady_first=steady_first,
                steady_last=steady_last,
            )
        )
    return phases


def _row_after(time: Array, start: int, trim: float, period: float) -> int:
    """Return the first row that is `trim` or more after row `start`; half a period decides what is equal."""
    return int(np.searchsorted(time, time[start] + trim - period / 2))


def _row_before(time: Array, stop: int, trim: float, period: float) -> int:
    """Return the end of the rows that are `trim` or more before the end of the last row of the phase."""
    return int(np.searchsorted(time, time[stop - 1] - trim + period / 2))


def _kind(feet: tuple[str, ...]) -> Kind:
    kinds: tuple[Kind, ...] = ("flight", "single", "double", "multiple")
    return kinds[min(len(feet), 3)]
