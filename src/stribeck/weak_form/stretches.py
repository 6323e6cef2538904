"""Which rows of a log the weak form uses, cut into stretches of one support."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from stribeck.contact import SupportPhase
from stribeck.robot import Robot

TRIM_START, TRIM_END = 0.05, 0.02
"""Left out after a foot has lifted and before one lands [s]; impacts are shorter than the trims of other methods."""

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
    robot: Robot, phases: tuple[SupportPhase, ...], segments: tuple[slice, ...], period: float, margin: int
) -> tuple[Stretch, ...]:
    """Return the stretches of all phases that the weak form can use.

    Parameters
    ----------
    robot
        The robot.
    phases, segments
        Of the log.
    period
        [s].
    margin
        Rows that filters need on either side within a segment.
    """
    found: list[Stretch] = []
    for phase in phases:
        if phase.kind == "flight" or not usable_support(robot, phase.feet):
            continue
        segment = next(s for s in segments if s.start <= phase.start < s.stop)
        begins = phase.start if phase.start > segment.start and phase.kind != "fixed" else None
        ends = phase.stop if phase.stop < segment.stop and phase.kind != "fixed" else None
        first, last = max(phase.start, segment.start + margin), min(phase.stop, segment.stop - margin)
        if begins is not None:
            first = max(first, begins + round(TRIM_START / period))
        if ends is not None:
            last = min(last, ends - round(TRIM_END / period))
        if last <= first:
            continue
        parts = -(-(last - first) // max(1, round(LONGEST / period)))
        edges = [first + (last - first) * part // parts for part in range(parts + 1)]
        found += [Stretch(start, stop, phase.feet, begins, ends) for start, stop in pairwise(edges)]
    return tuple(found)


def usable_support(robot: Robot, feet: tuple[str, ...]) -> bool:
    """Return whether the tree can be rooted at what stands: a fixed base, or one standing surface."""
    return robot.base == "fixed" or (len(feet) == 1 and robot.contacts[feet[0]].kind == "surface")
