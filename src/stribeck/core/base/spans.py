"""Spans of logs: selection by the name of a log, and formatting for messages and for `--exclude`."""

import os
from collections.abc import Mapping, Sequence
from math import ceil, floor
from pathlib import PurePath
from typing import NamedTuple

import numpy as np

from stribeck.core.base.typing import BoolArray, IntArray


class Span(NamedTuple):
    """Start and end [s] after the start of the log, and the file name of the log if there are several."""

    start: float
    end: float
    log: str = ""


def names_log(name: str, path: str) -> bool:
    """Return whether a name refers to a log: its path or the end of it, or its file name without suffix."""
    parts, log = PurePath(name).parts, PurePath(path)
    return log.parts[-len(parts) :] == parts or name == log.stem or os.path.abspath(name) == os.path.abspath(path)


def spans_of_log(spans: Sequence[tuple[float, float] | tuple[str, float, float]], path: str) -> list[Span]:
    """Select the spans of a log by its name."""
    return [Span(span[-2], span[-1]) for span in spans if len(span) == 2 or names_log(span[0], path)]


MOST = 5
"""Largest number of spans that a message lists [1]."""


def listed_spans(spans: Sequence[Span], notes: Mapping[Span, str] | None = None) -> str:
    """List spans, largest first, only the first few of many: "40.2 to 70.1 s (note), 81 to 83.5 s and 2 more"."""
    shown = []
    for span in longest(spans, MOST):
        name, note = f"{span.log} " if span.log else "", f" ({notes[span]})" if notes and span in notes else ""
        shown.append(f"{name}{' to '.join(_ends(span))} s{note}")
    return ", ".join(shown) + (f" and {len(spans) - MOST} more" if len(spans) > MOST else "")


def exclude_options(spans: Sequence[Span]) -> str:
    """Format the options that exclude spans: "--exclude 40.2:70.1 --exclude 81:83.5"."""
    parts = [[span.log, *_ends(span)] if span.log else _ends(span) for span in spans]
    return " ".join(f"--exclude {':'.join(part)}" for part in parts)


def longest(spans: Sequence[Span], most: int = 20) -> list[Span]:
    """Select the longest spans, the longest first."""
    return sorted(spans, key=lambda span: span.start - span.end)[:most]


def outward(span: Span) -> tuple[float, float]:
    """Round start and end outward to tenths of a second."""
    return max(0, floor(10 * span.start)) / 10, ceil(10 * span.end) / 10


def runs_of(flags: BoolArray) -> IntArray:
    """Find the runs of true flags: first place, and the place after the last, shape (runs, 2)."""
    return np.flatnonzero(np.diff(flags, prepend=False, append=False)).reshape(-1, 2)


def _ends(span: Span) -> list[str]:
    return [f"{end:g}" for end in outward(span)]
