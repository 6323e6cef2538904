"""What was found wrong, or odd, in a log, a robot file or a fit: a sentence, its evidence and its cure."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Finding:
    """Something that a user should act on.

    Attributes
    ----------
    check
        Name of the check that found it: the anchor of its paragraph in docs/findings.md.
    text
        What was found, where, and by what evidence.
    cure
        What mends it, with the line of the robot file where there is one; empty if nothing is known.
    joints
        That it is about; none if it is about the log or the robot as a whole.
    stops
        Whether it makes every number wrong: `identify` ends, unless it is told to go on.
    """

    check: str
    text: str
    cure: str = ""
    joints: tuple[str, ...] = ()
    stops: bool = False

    def __str__(self) -> str:
        """Return the text and the cure in one line."""
        return f"{self.text}; {self.cure}" if self.cure else self.text

    @property
    def line(self) -> str:
        """That line, with the place where the check is explained."""
        return f"{self} (docs/findings.md#{self.check})"
