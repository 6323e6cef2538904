"""Which rows of a log the weak form uses, cut into segments of one contact mode."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from itertools import pairwise

from stribeck.contact import SupportPhase
from stribeck.whole_log.equations.constants import (
    LEAST_LONGEST_SEGMENT,
    LONGEST_FLIGHT,
    LONGEST_SEGMENT,
    SEGMENTS_OF_A_LOG,
    TRIM_END,
    TRIM_LANDED,
    TRIM_LIFTED,
)


@dataclass(frozen=True)
class Segment:
    """Rows [first, last) of a log in the contact mode of `feet`, between contact changes, if there are any.

    They lie inside the rows `unbroken`, which have no gaps.
    """

    first: int
    last: int
    feet: tuple[str, ...]
    begins: int | None
    ends: int | None
    unbroken: slice

    def within(self, rows: slice) -> "Segment":
        """Return the part of the segment that lies inside some rows."""
        return replace(self, first=max(self.first, rows.start), last=min(self.last, rows.stop))


def cut_segments(
    phases: tuple[SupportPhase, ...],
    unbroken: tuple[slice, ...],
    period: float,
    margin: int,
    shortest: int,
    surfaces: Collection[str] = (),
) -> tuple[Segment, ...]:
    """Return the segments of all phases in which feet stand or all swing.

    Parameters
    ----------
    phases, unbroken
        Of the log.
    period
        [s].
    margin
        Rows that filters need on either side within a segment.
    shortest
        Rows that a segment must have.
    surfaces
        Feet that a tree may be rooted at; those that have just landed come last, as they still settle.
    """
    longest = _longest_segment(sum(phase.stop - phase.start for phase in phases) * period)
    found: list[Segment] = []
    before: tuple[str, ...] = ()
    for phase in (phase for phase in phases if phase.kind != "touching"):
        part_unbroken = next(s for s in unbroken if s.start <= phase.start < s.stop)
        begins = phase.start if phase.start > part_unbroken.start and phase.kind != "fixed" else None
        ends = phase.stop if phase.stop < part_unbroken.stop and phase.kind != "fixed" else None
        first, last = max(phase.start, part_unbroken.start + margin), min(phase.stop, part_unbroken.stop - margin)
        if begins is not None:
            landed = not set(phase.feet) <= set(before)
            first = max(first, begins + round((TRIM_LANDED if landed else TRIM_LIFTED) / period))
        if ends is not None:
            last = min(last, ends - round(TRIM_END / period))
        feet = tuple(sorted(phase.feet, key=lambda foot: foot in surfaces and foot not in before))
        before = phase.feet
        flies_too_long = phase.kind == "flight" and (phase.stop - phase.start) * period > LONGEST_FLIGHT
        if flies_too_long or last - first < shortest:
            continue
        parts = -(-(last - first) // max(shortest, round(longest / period)))
        edges = [first + (last - first) * part // parts for part in range(parts + 1)]
        found += [Segment(start, stop, feet, begins, ends, part_unbroken) for start, stop in pairwise(edges)]
    return tuple(found)


def _longest_segment(duration: float) -> float:
    """Return the length that a segment of a log may have [s]: shorter in a short log, so that there are folds of it."""
    return min(LONGEST_SEGMENT, max(LEAST_LONGEST_SEGMENT, duration / SEGMENTS_OF_A_LOG))
