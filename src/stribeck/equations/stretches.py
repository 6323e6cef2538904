"""Which rows of a log the weak form uses, cut into stretches of one support."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from itertools import pairwise

from stribeck.contact import SupportPhase

TRIM_LIFTED, TRIM_LANDED, TRIM_END = 0.05, 0.07, 0.02
"""Left out after a foot has lifted, after one has landed, and before either [s]: a landing foot chatters."""

LONGEST = 1.6
"""Of a stretch [s]: errors of different stretches count as independent."""


@dataclass(frozen=True)
class Stretch:
    """Rows [first, last) of a log on the support of `feet`, which begins and ends at contact changes, if at any."""

    first: int
    last: int
    feet: tuple[str, ...]
    begins: int | None
    ends: int | None


def cut_stretches(
    phases: tuple[SupportPhase, ...],
    segments: tuple[slice, ...],
    period: float,
    margin: int,
    shortest: int,
    surfaces: Collection[str] = (),
) -> tuple[Stretch, ...]:
    """Return the stretches of all phases in which something stands.

    Parameters
    ----------
    phases, segments
        Of the log.
    period
        [s].
    margin
        Rows that filters need on either side within a segment.
    shortest
        Rows that a stretch must have.
    surfaces
        Feet that a tree may be rooted at; those that have just landed come last, as they still settle.
    """
    found: list[Stretch] = []
    before: tuple[str, ...] = ()
    for phase in phases:
        segment = next(s for s in segments if s.start <= phase.start < s.stop)
        begins = phase.start if phase.start > segment.start and phase.kind != "fixed" else None
        ends = phase.stop if phase.stop < segment.stop and phase.kind != "fixed" else None
        first, last = max(phase.start, segment.start + margin), min(phase.stop, segment.stop - margin)
        if begins is not None:
            landed = not set(phase.feet) <= set(before)
            first = max(first, begins + round((TRIM_LANDED if landed else TRIM_LIFTED) / period))
        if ends is not None:
            last = min(last, ends - round(TRIM_END / period))
        feet = tuple(sorted(phase.feet, key=lambda foot: foot in surfaces and foot not in before))
        before = phase.feet
        if phase.kind == "flight" or last - first < shortest:
            continue
        parts = -(-(last - first) // max(shortest, round(LONGEST / period)))
        edges = [first + (last - first) * part // parts for part in range(parts + 1)]
        found += [Stretch(start, stop, feet, begins, ends) for start, stop in pairwise(edges)]
    return tuple(found)
