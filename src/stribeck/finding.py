"""What was found wrong, or odd, in a log, a robot file or a fit: a sentence, its evidence and its cure."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

NAMED = 6
"""Logs that a sentence names before it counts the others."""


FRICTION = "friction-"
"""What the names of checks begin with that say so of friction."""


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
    channel
        Of the log that is wrong, where it is a single one, e.g. "torque".
    logs
        Paths of those that it was found in, where there are several.
    stops
        Whether it makes every number wrong: `identify` ends, unless it is told to go on.
    """

    check: str
    text: str
    cure: str = ""
    joints: tuple[str, ...] = ()
    channel: str = ""
    logs: tuple[str, ...] = ()
    stops: bool = False

    def __str__(self) -> str:
        """Return the text and the cure in one line."""
        return f"{self.text}; {self.cure}" if self.cure else self.text

    @property
    def on_friction(self) -> bool:
        """Whether it says that the friction found in its joints is off by more than their intervals say."""
        return self.check.startswith(FRICTION)

    @property
    def place(self) -> str:
        """Where the check is explained, with an example."""
        return f"docs/findings.md#{self.check}"

    @property
    def line(self) -> str:
        """That line, with its place."""
        return f"{self} ({self.place})"


def merged(by_log: Sequence[tuple[str, Sequence[Finding]]]) -> list[Finding]:
    """Return the findings of logs, given with their paths; one of the same kind in several logs is told once.

    Those are of one check, channel and joints. Where their evidence differs it is the first log's. The findings of a
    single log stay as they are.
    """
    if len(by_log) == 1:
        return list(by_log[0][1])
    groups: dict[tuple[object, ...], list[tuple[str, Finding]]] = {}
    for path, findings in by_log:
        for finding in findings:
            kind = (finding.check, finding.channel, finding.joints, finding.stops)
            groups.setdefault(kind, []).append((path, finding))
    return [_of_logs(group) for group in groups.values()]


def _of_logs(group: list[tuple[str, Finding]]) -> Finding:
    """Return one finding for those of one kind."""
    first = group[0][1]
    logs = tuple(dict.fromkeys(path for path, _ in group))
    if all(finding.text == first.text for _, finding in group):
        return replace(first, text=f"{_listed(logs)}: {first.text}", logs=logs)
    more = f" (and likewise in {_listed(logs[1:])})" if logs[1:] else ""
    return replace(first, text=f"{logs[0]}: {first.text}{more}", logs=logs)


def _listed(paths: Sequence[str]) -> str:
    more = f" and {len(paths) - NAMED} more" if len(paths) > NAMED else ""
    return ", ".join(paths[:NAMED]) + more
