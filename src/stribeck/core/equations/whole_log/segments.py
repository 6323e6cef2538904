"""Segments of a log in one contact mode, which the weak form uses."""

from collections.abc import Collection
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from stribeck.core.dynamics.contact import SupportPhase
from stribeck.core.dynamics.contact.phases import trims

LONGEST_SEGMENT = 1.6
"""Longest segment [s]: errors of different segments count as independent."""


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


def cut_segments(
    phases: tuple[SupportPhase, ...],
    unbroken: tuple[slice, ...],
    period: float,
    margin: int,
    shortest: int,
    surfaces: Collection[str] = (),
) -> tuple[Segment, ...]:
    """Cut all phases in which feet stand or all swing into segments.

    Parameters
    ----------
    phases, unbroken
        Support phases of the log, and its rows between gaps.
    period
        Sampling period [s].
    margin
        Rows on either side of a segment that filters need.
    shortest
        Smallest number of rows of a segment. Where little of the log would be left, phases are trimmed less.
    surfaces
        Feet that a tree may be rooted at. The feet that have just landed come last in a segment, because they still
        settle.
    """
    rows = sum(phase.stop - phase.start for phase in phases)
    longest = min(LONGEST_SEGMENT, max(0.4, rows * period / 12))  # [s]; more segments than folds, windows still overlap

    def cut(hurried: bool) -> tuple[Segment, ...]:
        """Cut phases into segments up to `longest`; `hurried` phases are trimmed by a share of their duration."""
        segments: list[Segment] = []
        before: tuple[str, ...] = ()
        for phase in (phase for phase in phases if phase.kind != "touching"):
            part = next(part for part in unbroken if part.start <= phase.start < part.stop)
            first, last = max(phase.start, part.start + margin), min(phase.stop, part.stop - margin)
            begins = phase.start if phase.steps else None  # a log may begin with a contact change
            ends = phase.stop if phase.steps and phase.stop < part.stop else None
            settling = 0.02 if not phase.feet else 0.05 if set(phase.feet) <= set(before) else 0.07  # [s]; feet chatter
            duration = (phase.stop - phase.start) * period if hurried else np.inf
            after, until = trims(duration, settling, 0.02, shortest * period)
            if begins is not None:
                first = max(first, begins + round(after / period))
            if ends is not None:
                last = min(last, ends - round(until / period))
            feet = tuple(sorted(phase.feet, key=lambda foot: foot in surfaces and foot not in before))
            before = phase.feet
            if not phase.plausible(period) or last - first < shortest:
                continue
            parts = -(-(last - first) // max(shortest, round(longest / period)))
            edges = [first + (last - first) * k // parts for k in range(parts + 1)]
            segments += [Segment(start, stop, feet, begins, ends, part) for start, stop in pairwise(edges)]
        return tuple(segments)

    segments = cut(False)
    return segments if sum(segment.last - segment.first for segment in segments) > 0.2 * rows else cut(True)
